"""False alarms: the runs of the models, a measured one, and simulated temperatures have no findings but true ones."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from twin.face.check import expected as expected_of
from twin.logs.check import check_run
from twin.logs.read import parse_run

ROOT = Path(__file__).parents[2]
RUNS = sorted(
    p.parent for pattern in ("models/*/runs/*/run.toml", "tests/machines/*/runs/*/run.toml") for p in ROOT.glob(pattern)
)
MEASURED = Path(os.environ.get("TWIN_MEASURED_DATA", ROOT.parent / "shared" / "data"))
# what is so: axes that stand still, or go to and fro alike all day, rotary axes beyond the angle that the structure is
# evaluated at
TRUE = (
    r"columns? '\w+'(, '\w+')* (is|are) zero throughout",
    r"'[bc]_position' spans .* rad, \d+ rows outside -0.0174533 .. 0.0174533",
    r"column 'y_(force|current)' never changes \(.*\)",
    r"loads are logged every [\d.]+ s, the axes' limits ask for .*",
)


@pytest.mark.parametrize("folder", RUNS, ids=lambda p: f"{p.parent.parent.name}/{p.name}")
def test_runs_of_the_models(folder):
    run = parse_run(folder)
    expected = expected_of(folder, run.machine, None)
    problems = check_run(run, expected.signals, expected.axes, expected.sensors, expected.core, expected.strokes)
    spurious = [str(p) for p in problems if not any(re.fullmatch(true, p.what) for true in TRUE)]
    assert spurious == []
    assert all(p.warning for p in problems)
    moving = {c for c, values in run.loads.columns.items() if values.any()}
    for p in problems:
        if "zero throughout" in p.what:
            assert not moving & set(re.findall(r"'(\w+)'", p.what))


def test_there_are_runs():
    assert len(RUNS) >= 14


def test_a_measured_run_of_32_hours():
    folder = MEASURED / "spindle_drift" / "warmup"
    if not folder.exists():
        pytest.skip("no measured data here")
    assert check_run(parse_run(folder)) == []
