"""docs/artefact.md suffices to step an artefact: a script written by it gives what the runtime gives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import twin
from tests.reference.by_the_page import sensors_over
from twin.logs.read import read_run
from twin.rom.artefact import read_artefact
from twin.run.replay import replay

ROOT = Path(__file__).parents[2]
SAME = 1e-9  # K, after the last step as after the first: nothing but rounding


def apart(path: Path, folder: Path) -> float:
    """The largest difference of any sensor at any time [K]."""
    artefact = read_artefact(path)
    result = replay(artefact, read_run(folder))
    by_runtime = result.temperature[:, : len(artefact.model.sensors)]
    assert np.ptp(by_runtime) > 5.0
    return float(np.abs(sensors_over(path, folder) - by_runtime).max())


def test_a_meshed_machine(slide_artefact):
    assert apart(slide_artefact, ROOT / "tests" / "machines" / "slide" / "runs" / "short") < SAME


def test_a_lumped_machine(tmp_path):
    folder = ROOT / "tests" / "machines" / "spindle"
    twin.build(folder, options=twin.BuildOptions(held_out=4)).save(tmp_path / "a.h5")
    assert apart(tmp_path / "a.h5", folder / "runs" / "warm_up") < SAME


@pytest.mark.long
@pytest.mark.parametrize("name", ["ball_screw_axis/mixed_load", "five_axis/experiment_a"])
def test_a_shipped_machine_over_many_hours(tmp_path, name):
    machine, run = name.split("/")
    folder = ROOT / "models" / machine
    twin.build(folder, options=twin.BuildOptions(held_out=1)).save(tmp_path / "a.h5")
    assert apart(tmp_path / "a.h5", folder / "runs" / run) < SAME
