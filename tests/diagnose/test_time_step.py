"""Steps of a diagnosis: shorter than a minute where a light part would be lost in that."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.diagnose.test_lumped import MACHINE, NULLS, loads, twin
from twin.diagnose.model.probed_model import make_probed_model
from twin.diagnose.model.time_step import step_error, time_step
from twin.logs.read import read_run
from twin.machine.load import load_machine
from twin.machine.parameters import parameters

BEARING = """
[nodes.bearing]
capacity = "{capacity} kJ/K"
area = "0.02 m^2"

[contacts.ring]
kind = "fixed"
surfaces = ["bearing", "head"]
total = "16 W/K"

[sensors.bearing]
part = "bearing"

[sources.warm]
law = "bearing_friction_warm"
surface = "bearing"
signals = {{ speed = "speed" }}

[sources.warm.parameters]
f0 = 2.0
viscosity_40 = "32 mm^2/s"
viscosity_100 = "5.5 mm^2/s"
diameter = "90 mm"
f1 = 0.0004
load = "900 N"
"""


def with_bearing(folder: Path, capacity: float) -> Path:
    """The four nodes and a bearing of some kJ/K, whose friction falls as it warms."""
    folder.mkdir()
    text = (MACHINE / "machine.toml").read_text(encoding="utf-8")
    film = 'surfaces = ["motor", "head"]\nenvironment'
    assert text.count(film) == 1
    text = text.replace(film, film.replace('"head"', '"head", "bearing"'))
    (folder / "machine.toml").write_text(text + BEARING.format(capacity=capacity), encoding="utf-8")
    return folder


@pytest.mark.parametrize(("capacity", "longest"), [(1.6, 30.0), (40.0, 60.0)])
def test_steps_are_as_short_as_the_lightest_part_needs(tmp_path, capacity, longest):
    machine = load_machine(with_bearing(tmp_path / "machine", capacity))
    runs = [read_run(loads(tmp_path / "monday", 0))]
    probed = make_probed_model(machine, parameters(machine), runs)
    step = time_step(machine, probed, runs)
    assert step == longest
    finer = make_probed_model(machine, parameters(machine), runs, step=step)
    assert finer.runs[0].step == step
    assert finer.runs[0].drive.n_steps == pytest.approx(
        probed.runs[0].drive.n_steps * probed.runs[0].step / step, abs=1
    )


def test_the_error_of_a_step_is_that_of_the_worst_sensor():
    fine = np.zeros((7, 2))
    coarse = np.zeros((4, 2))
    coarse[:, 1] = [0.0, 0.2, 0.2, 0.0]
    assert step_error(coarse, fine) == pytest.approx(np.sqrt(0.02))
    assert step_error(coarse, fine[:6]) == pytest.approx(np.sqrt(0.08 / 3))  # the last of the coarse ones is beyond it


@pytest.mark.slow
def test_a_light_bearing_that_warms_is_no_cause(tmp_path):
    """In steps of a minute it is off in every run alike, which would be told as a cause."""
    machine = with_bearing(tmp_path / "machine", 1.6)
    noise = ("--noise", "0.05 K", "--tcp-noise", "1 um", "--substeps", 8)
    for seed, day in enumerate(("monday", "tuesday")):
        loads(tmp_path / day, 4 * seed)
        twin("simulate", machine, tmp_path / day, "-o", tmp_path / f"{day}_shown", *noise, "--seed", seed)
    twin("build", machine, "-o", tmp_path / "m.h5", "--substeps", 8)
    days = [tmp_path / f"{day}_shown" for day in ("monday", "tuesday")]
    twin("diagnose", tmp_path / "m.h5", *days, "-o", tmp_path / "found", "--noise", "0.05 K", *NULLS)
    found = json.loads((tmp_path / "found" / "report.json").read_text(encoding="utf-8"))
    assert (found["verdict"], found["causes"]) == ("nothing", [])
