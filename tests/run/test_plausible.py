"""Results that cannot be are not given out: exit status 1 and one message."""

from __future__ import annotations

import dataclasses
import shutil

import numpy as np
import pytest
import synthetic
import synthetic_run

from twin.cli.main import run
from twin.errors import FailedCheck
from twin.rom.artefact import read_artefact
from twin.run.plausible import refuse_glowing, refuse_not_finite, refuse_unbalanced
from twin.run.replay import replay

MODEL = synthetic.machine(2)
TIME = np.array([0.0, 60.0, 120.0])


@pytest.fixture(scope="module")
def artefact(tmp_path_factory):
    return synthetic_run.artefact(tmp_path_factory.mktemp("a") / "a.h5", MODEL)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return synthetic_run.run_folder(tmp_path_factory.mktemp("r") / "run", MODEL, hours=0.5)


def with_currents(folder, target, value):
    shutil.copytree(folder, target)
    lines = (target / "loads.csv").read_text().splitlines()
    column = next(i for i, name in enumerate(lines[0].split(",")) if "current" in name)
    rows = [line.split(",") for line in lines]
    for row in rows[1:]:
        row[column] = value
    (target / "loads.csv").write_text("\n".join(map(",".join, rows)) + "\n")
    return target


@pytest.mark.parametrize("current", ["1e4", "1e14"])
def test_loads_that_no_machine_survives_are_exit_1(artefact, folder, tmp_path, capsys, current):
    loads = with_currents(folder, tmp_path / "run", current)
    assert run(["run", str(artefact), str(loads), "-o", str(tmp_path / "out")]) == 1
    told = capsys.readouterr().err
    assert "K from the reference temperature after" in told
    assert told.count("error: ") == told.count("remedy: ") == 1
    assert not list((tmp_path / "out").glob("result*"))


def test_a_model_that_loses_heat_gives_no_result(artefact):
    sound = read_artefact(artefact)
    log = synthetic_run.run(MODEL, hours=0.5)
    assert replay(sound, log).balance_error.max() < 1e-9
    body = dataclasses.replace(MODEL.bodies[0], energy=1.01 * MODEL.bodies[0].energy)
    model = dataclasses.replace(MODEL, bodies=(body, *MODEL.bodies[1:]))
    with pytest.raises(FailedCheck, match="the heat balance is off by") as caught:
        replay(dataclasses.replace(sound, model=model), log)
    assert caught.value.status == 1
    assert "twin info --check" in caught.value.problems[0].remedy


def test_the_first_step_that_is_wrong_is_named():
    with pytest.raises(FailedCheck, match="after 60 s"):
        refuse_not_finite(TIME, np.array([[0.0], [np.nan], [0.0]]))
    with pytest.raises(FailedCheck, match=r"b is -1500 K .* after 120 s"):
        refuse_glowing(TIME, np.array([[0.0, 0.0], [0.0, 0.0], [999.0, -1500.0]]), ("a", "b"))
    with pytest.raises(FailedCheck, match=r"off by 2\.0e-06 .* first after 120 s"):
        refuse_unbalanced(TIME, np.array([1e-7, 2e-6]))
    with pytest.raises(FailedCheck, match="first after 60 s"):
        refuse_unbalanced(TIME, np.array([np.nan, 0.0]))
    refuse_glowing(TIME, np.full((3, 1), 900.0), ("a",))
    refuse_unbalanced(TIME, np.array([0.0, 1e-8]))
