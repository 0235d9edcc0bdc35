"""twin diagnose refuses with exit status 2 and a remedy what cannot be diagnosed."""

from __future__ import annotations

import pytest

from tests.calibrate import lumped_case
from twin.cli.main import run
from twin.rom.artefact import write_artefact

RUN = next(f for f in (lumped_case.FOLDER / "runs").iterdir() if f.is_dir())


@pytest.fixture(scope="module")
def artefact(tmp_path_factory):
    """The lumped machine of the tests."""
    a = lumped_case.artefact()
    path = tmp_path_factory.mktemp("diagnose") / "spindle.h5"
    write_artefact(path, a.model, a.description, {}, a.provenance, parameters=a.parameters)
    return path


def refused(arguments, capsys):
    assert run(["diagnose", *map(str, arguments)]) == 2
    told = capsys.readouterr()
    assert "Traceback" not in told.err
    assert told.out == ""
    return told.err


def test_nothing_to_diagnose(capsys):
    assert "an artefact and measured runs are needed" in refused([], capsys)


def test_an_artefact_without_runs(artefact, capsys):
    assert "an artefact and measured runs are needed" in refused([artefact], capsys)


def test_no_folder_for_the_report(artefact, capsys):
    assert "-o" in refused([artefact, RUN], capsys)


@pytest.mark.parametrize("twice", [[RUN, RUN], [RUN, "--sealed", RUN], [RUN, RUN.parent / ".." / "runs" / RUN.name]])
def test_the_same_run_twice(artefact, tmp_path, twice, capsys):
    assert "a run is given twice" in refused([artefact, *twice, "-o", tmp_path / "out"], capsys)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("option", "value"),
    [("--noise", "0.1 m"), ("--noise", "-0.1 K"), ("--tcp-noise", "1 K"), ("--noise", "little")],
)
def test_noise_that_is_none(artefact, tmp_path, option, value, capsys):
    told = refused([artefact, RUN, "-o", tmp_path / "out", option, value], capsys)
    assert option in told


def test_a_sensor_that_is_none(artefact, tmp_path, capsys):
    told = refused([artefact, RUN, "-o", tmp_path / "out", "--exclude", "hosing"], capsys)
    assert "no sensor 'hosing'" in told
    assert "housing" in told


def test_files_that_are_not_there(artefact, tmp_path, capsys):
    assert "nowhere.h5" in refused([tmp_path / "nowhere.h5", RUN, "-o", tmp_path / "out"], capsys)
    assert "nothing_here" in refused([artefact, tmp_path / "nothing_here", "-o", tmp_path / "out"], capsys)


def test_the_folder_of_a_run_is_no_folder_for_a_report(artefact, capsys):
    refused([artefact, RUN, "-o", RUN], capsys)
    assert not (RUN / "index.html").exists()


def test_too_few_synthetic_measurements(artefact, tmp_path, capsys):
    assert "--nulls" in refused([artefact, RUN, "-o", tmp_path / "out", "--nulls", "3"], capsys)


def test_a_run_without_measurements(artefact, tmp_path, capsys):
    told = refused([artefact, RUN, "-o", tmp_path / "out"], capsys)
    assert "nothing measured that the model predicts" in told


def test_a_machine_that_has_moved(artefact, tmp_path, capsys):
    told = refused([artefact, RUN, "-o", tmp_path / "out", "--machine", tmp_path / "gone" / "machine.toml"], capsys)
    assert "--machine" in told
