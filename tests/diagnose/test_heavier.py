"""A node that stores twice what its description says, and whose loss would do for most of that."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.diagnose.test_lumped import MACHINE, loads, twin
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.pipeline import Settings, prepare
from twin.diagnose.search.excused import other_search
from twin.diagnose.search.verdict import verdict_of
from twin.logs.read import read_run
from twin.machine.load import load_machine

pytestmark = pytest.mark.long


def test_a_capacity_that_a_loss_would_imitate_is_compared_with_it_exactly(tmp_path: Path) -> None:
    """Calibration takes its bearings' loss by three tolerances, and by the derivative there little is left for it."""
    twin("hide", "capacity", "head", "2", MACHINE, "-o", tmp_path / "heavy")
    runs = []
    for seed in (0, 4):
        run = loads(tmp_path / f"{seed}", seed)
        noise = ("--noise", "0.1 K", "--tcp-noise", "1 um", "--seed", seed)
        twin("simulate", tmp_path / "heavy", run, "-o", tmp_path / f"measured_{seed}", *noise)
        runs.append(read_run(tmp_path / f"measured_{seed}"))
    detector = prepare(load_machine(MACHINE), runs, [], Settings(nulls=40, form=32))[0]
    verdict, (cause, *others) = verdict_of(other_search(detector, runs)[0], FAMILIES)
    assert (verdict, cause.family, cause.place, others) == ("named", "capacity", "head", [])
    assert cause.ci95[0] < 20e3 < cause.ci95[1]
    assert cause.amplitude == pytest.approx(20e3, rel=0.3)
