"""Stretches of which the loads say nothing: no cause is told by what the machine may have done there."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from tests.diagnose.test_lumped import MACHINE, NULLS, loads, twin
from twin.diagnose.model.probed_model import make_probed_model
from twin.logs.clocks import gaps_of
from twin.logs.read import read_run
from twin.logs.run import Run
from twin.logs.write import write_run
from twin.machine.load import load_machine
from twin.machine.parameters import parameters

HOUR = 3600.0


def lacking(run: Run, *stretches: tuple[float, float]) -> Run:
    """The run without rows of its loads between these times [s]."""
    t = run.loads
    kept = ~np.any([(t.time > begin) & (t.time < end) for begin, end in stretches], axis=0)
    return replace(run, loads=replace(t, time=t.time[kept], columns={n: v[kept] for n, v in t.columns.items()}))


def test_stretches_without_loads_are_known_by_their_steps(tmp_path):
    day = lacking(read_run(loads(tmp_path / "day", 0)), (HOUR, 2 * HOUR), (3 * HOUR, 3 * HOUR + 240.0))
    assert gaps_of(day.loads) == [(HOUR + 60.0, 2 * HOUR), (3 * HOUR + 60.0, 3 * HOUR + 240.0)]
    machine = load_machine(MACHINE)
    (run,) = make_probed_model(machine, parameters(machine), [day]).runs
    assert [run.unlogged[0][0], run.unlogged[-1][1], len(run.unlogged)] == [61, 120, 6]
    assert all(
        end == first for (_, end), (first, _) in pairwise(run.unlogged)
    )  # less than a mean of readings is no gap


@pytest.mark.slow
def test_what_a_machine_did_meanwhile_is_no_cause(tmp_path):
    """The logs lack 40 and 50 min in which it rested or began to work: that was heat in a window."""
    twin("build", MACHINE, "-o", tmp_path / "four.h5")
    days = []
    for seed, day in enumerate(("monday", "tuesday")):
        loads(tmp_path / f"{day}_loads", 4 * seed)
        noise = ("--noise", "0.1 K", "--seed", seed)
        twin("simulate", MACHINE, tmp_path / f"{day}_loads", "-o", tmp_path / f"{day}_whole", *noise)
        whole = replace(read_run(tmp_path / f"{day}_whole"), tcp=None)
        days.append(tmp_path / day)
        write_run(days[-1], lacking(whole, (0.8 * HOUR, 1.5 * HOUR), (4.6 * HOUR, 5.5 * HOUR)))
    twin("diagnose", tmp_path / "four.h5", *days, "-o", tmp_path / "found", *NULLS, "--no-build")
    found = json.loads((tmp_path / "found" / "report.json").read_text(encoding="utf-8"))
    assert (found["verdict"], found["causes"]) == ("nothing", [])
