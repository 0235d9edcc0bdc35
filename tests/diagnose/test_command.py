"""twin diagnose refuses with exit status 2 and a remedy what cannot be diagnosed, and leaves a folder of one report."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tests.calibrate import lumped_case
from tests.diagnose.made_up import diagnosis
from twin.build.cache import machine_hash
from twin.cli.diagnose import command
from twin.cli.main import run
from twin.diagnose.pipeline import Result, Settings, diagnose, machine_of
from twin.diagnose.result.diagnosis import Cause, Window
from twin.errors import ArtefactError
from twin.logs.read import read_run
from twin.logs.run import Table
from twin.machine.load import load_machine
from twin.rom.artefact import write_artefact

RUN = next(f for f in (lumped_case.FOLDER / "runs").iterdir() if f.is_dir())


@pytest.fixture(scope="module")
def artefact(tmp_path_factory):
    """The lumped machine of the tests."""
    a = lumped_case.artefact()
    path = tmp_path_factory.mktemp("diagnose") / "spindle.h5"
    provenance = {**a.provenance, "machine_hash": machine_hash(load_machine(lumped_case.FOLDER))}
    write_artefact(path, a.model, a.description, {}, provenance, parameters=a.parameters)
    return path


def refused(arguments, capsys):
    assert run(["diagnose", *map(str, arguments)]) == 2
    told = capsys.readouterr()
    assert "Traceback" not in told.err
    assert told.out == ""
    return told.err


def test_nothing_to_diagnose_is_refused(capsys):
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


def test_a_plan_for_a_family_that_is_none(artefact, tmp_path, capsys):
    told = refused([artefact, RUN, "-o", tmp_path / "out", "--plan", "heat_sorce bed"], capsys)
    assert "did you mean 'heat_source'" in told
    assert "--plan" in told


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


def test_defaults_are_those_of_the_library():
    options = {p.name: p for p in command.params}
    assert options["nulls"].default == Settings().nulls
    assert f"; {Settings().form} more for model discrepancy" in options["nulls"].help


def test_a_seed_that_is_none(artefact, tmp_path, capsys):
    assert "--seed" in refused([artefact, RUN, "-o", tmp_path / "out", "--seed", "-1"], capsys)


def test_the_folder_of_what_is_read_is_no_folder_for_a_report(artefact, tmp_path, capsys):
    machine, day = tmp_path / "machine", tmp_path / "days" / "monday"
    shutil.copytree(lumped_case.FOLDER, machine)
    shutil.copytree(RUN, day)
    for target in (artefact.parent, machine, day.parent, tmp_path):
        before = sorted(target.rglob("*"))
        told = refused([artefact, day, "-o", target, "--machine", machine / "machine.toml"], capsys)
        assert f"{target}: holds what is read" in told
        assert sorted(target.rglob("*")) == before


def test_meshes_that_changed_since_the_build(tmp_path):
    machine = tmp_path / "machine.toml"
    a = lumped_case.artefact()
    machine.write_text(a.description, encoding="utf-8")
    built = {"machine": str(machine), "machine_hash": machine_hash(load_machine(machine))}
    assert machine_of(replace(a, provenance=built), tmp_path / "a.h5").machine.name == "spindle"
    other = replace(a, provenance={**built, "machine_hash": "of other meshes"})
    with pytest.raises(ArtefactError, match="is not the machine this artefact was built from"):
        machine_of(other, tmp_path / "a.h5")
    calibrated = replace(other, provenance={**other.provenance, "calibrated_from": "another"})
    assert machine_of(calibrated, tmp_path / "a.h5").machine.name == "spindle"  # has a description of its own


@pytest.mark.parametrize("exclude", [(), ("front",)])
def test_a_stuck_sensor_that_is_left_out_is_not_looked_at(exclude, monkeypatch):
    seen = []

    def prepare(machine, runs, *more):
        seen.append(runs[0].temperatures.columns["front"])
        raise InterruptedError

    monkeypatch.setattr("twin.diagnose.pipeline.prepare", prepare)
    time = 60.0 * np.arange(200)
    columns = {name: 20.0 + np.random.default_rng(k).random(200) for k, name in enumerate(("front", "housing"))}
    columns["front"][100:] = 20.5
    run = replace(read_run(RUN), temperatures=Table(time, columns, dict.fromkeys(columns, "degC")))
    with pytest.raises(InterruptedError):
        diagnose(lumped_case.artefact(), load_machine(lumped_case.FOLDER), [run], (), Settings(exclude=exclude))
    assert np.isnan(seen[0][101:]).all() == (not exclude)


HEAT = Cause("heat_source", "housing", "", 12.0, (10.0, 14.0), "W", 90.0, 20.0)


def windowed(*names: str) -> Cause:
    windows = tuple(Window(name, 600.0 * k, 600.0 * (k + 1)) for k, name in enumerate(names, start=1))
    return replace(HEAT, windows=windows)


@pytest.fixture
def found(monkeypatch):
    """Makes every diagnosis one that finds the causes given; artefacts are not built but touched."""

    def give(*causes: Cause) -> None:
        made = replace(
            diagnosis("named" if causes else "nothing"), causes=causes, pulls=(), ranked=(), series=(), gain=(),
            cosine=np.zeros((0, 0)), nulls={}, thresholds={}, observed={}, whiteness=(),
        )  # fmt: skip
        search = SimpleNamespace(detector=SimpleNamespace(study=SimpleNamespace(probed=None)))
        monkeypatch.setattr("twin.diagnose.pipeline.diagnose", lambda *_: Result(made, search, causes))

    monkeypatch.setattr("twin.diagnose.extend.build_artefact", lambda _, to, **more: to.write_bytes(b"built"))
    return give


def files(folder: Path) -> list[str]:
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())


def report(folder: Path) -> dict:
    return json.loads((folder / "report.json").read_text(encoding="utf-8"))


REPORT = ["index.html", "report.json"]
EXTENSION = ["extended.h5", "machine.toml"]
LOADS = ["runs/warm_up/loads.csv", "runs/warm_up/run.toml"]


@pytest.mark.long
def test_a_folder_is_that_of_its_newest_report(artefact, tmp_path, found):
    out = tmp_path / "out"
    arguments = ["diagnose", str(artefact), str(RUN), "-o", str(out)]
    for _ in range(2):  # a second time into the same folder
        found(windowed("warm_up"))
        assert run(arguments) == 0
        assert files(out) == sorted([*REPORT, *EXTENSION, *LOADS])
        assert report(out)["causes"][0]["parameter"] == "sources.found_1.gain"
    (out / "notes.txt").write_text("mine", encoding="utf-8")
    (out / "runs" / "mine").mkdir()
    (out / "runs" / "mine" / "loads.csv").write_text("mine", encoding="utf-8")
    mine = ["notes.txt", "runs/mine/loads.csv"]
    found(HEAT)
    assert run([*arguments, "--no-build"]) == 0
    assert files(out) == sorted([*REPORT, "machine.toml", *mine])
    found()
    assert run(arguments) == 0
    assert files(out) == sorted([*REPORT, *mine])
    assert report(out)["verdict"] == "nothing"


@pytest.mark.long
def test_an_interrupted_build_leaves_the_report(artefact, tmp_path, found, monkeypatch, capsys):
    def interrupted(*_, **more):
        raise KeyboardInterrupt

    found(HEAT)
    out = tmp_path / "out"
    monkeypatch.setattr("twin.diagnose.extend.build_artefact", interrupted)
    assert run(["diagnose", str(artefact), str(RUN), "-o", str(out)]) == 130
    assert files(out) == sorted([*REPORT, "machine.toml"])
    assert report(out)["causes"][0]["parameter"] == "sources.found_1.gain"
    assert "machine.toml" in capsys.readouterr().out


def test_files_of_others_are_not_replaced(artefact, tmp_path, found, capsys):
    found(windowed("warm_up"))
    for name in ("machine.toml", "report.json", "runs/warm_up/loads.csv"):
        out = tmp_path / name.split("/")[0]
        (out / name).parent.mkdir(parents=True)
        (out / name).write_text("{}", encoding="utf-8")
        assert "holds another" in refused([artefact, RUN, "-o", out], capsys)
        assert files(out) == [name]


def test_runs_whose_folders_have_one_name(artefact, tmp_path, found, monkeypatch):
    for week in "ab":
        shutil.copytree(RUN, tmp_path / week / "day")
    monkeypatch.chdir(tmp_path / "a" / "day")
    found(windowed("day", "day-2"))
    out = tmp_path / "out"
    assert run(["diagnose", str(artefact), ".", str(tmp_path / "b" / "day"), "-o", str(out)]) == 0
    for name, start in (("day", 600.0), ("day-2", 1200.0)):
        loads = read_run(out / "runs" / name).loads
        on = loads.time[loads.columns["found_1"] > 0.0]
        assert start - 60.0 < on.min() <= on.max() < start + 600.0
