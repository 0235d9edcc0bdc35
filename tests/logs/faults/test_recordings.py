"""Faults of real recordings, and planted into them: 23 days of a lathe, 32 hours of a spindle. Skipped without them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from models.measured import VARIABLE
from models.recordings import lathe_days, lathe_run, spindle_run
from twin.inject.damage.channels import Damage
from twin.inject.damage.kinds import damaged
from twin.logs.check import check_run
from twin.logs.faults.fault import Fault
from twin.logs.faults.find import faults_of
from twin.logs.run import Run

CASES = 12  # of each kind
SPLICED = "20200706"  # the data's own README: every channel leaps at 329 min


@cache
def recordings() -> dict[str, Run]:
    days = {path.stem: lathe_run(path) for path in lathe_days()}
    spindle = spindle_run(0.0, 32.0)
    if not days or spindle is None:
        pytest.skip(f"no measured data; {VARIABLE} names the folder that holds lathe and spindle_drift")
    return {**days, "spindle": spindle}


@cache
def known(name: str) -> tuple[Fault, ...]:
    return tuple(faults_of(recordings()[name]))


def test_clean_days_have_no_faults_but_probes_that_rest_with_the_machine():
    assert len(recordings()) == 24
    for name in recordings():
        if name != SPLICED:
            assert {(f.kind, f.table) for f in known(name)} <= {("stuck", "tcp")}, name
    for name in ("20200723", "20200810"):  # the spindle rests for an hour after 2.5 h
        (rest,) = known(name)
        assert rest.channels == ("dx", "dz")
        assert 2.3 < rest.first_time / 3600.0 < 2.6
        assert 3.4 < rest.last_time / 3600.0 < 3.6


def test_the_spliced_day_is_told_once_with_its_line():
    (fault,) = known(SPLICED)
    assert fault.kind == "splice"
    assert len(fault.channels) >= 20
    assert 3.0 < fault.size < 7.0  # K
    assert fault.first_time / 60.0 == pytest.approx(329.0, abs=2.0)
    told = [p for p in check_run(recordings()[SPLICED]) if "no value at all" not in p.what and "a gap" not in p.what]
    assert [p.where.rpartition("/")[2] for p in told] == [f"temperatures.csv (line {fault.first_row + 2})"]
    assert told[0].what.startswith(f"rows of another time from line {fault.first_row + 2} on")


def planted(kind: str, rng: np.random.Generator, start: float) -> tuple[Damage, str]:
    sensor = f"sensors.PT{rng.integers(1, 14):02}"
    return {
        "noise": (Damage("sensor", sensor, 15.0, "noise", start=start), sensor[8:]),
        "rail": (Damage("sensor", sensor, float(rng.choice([-200.0, 0.0, 850.0])), "rail", start=start), sensor[8:]),
        "leap": (Damage("sensor", sensor, float(rng.choice([-4.0, 6.0])), "offset", start=start), sensor[8:]),
        "splice": (Damage("signal", "run", 5400.0, "splice", start=start), ""),
    }[kind]


@pytest.mark.parametrize("kind", ["noise", "rail", "leap", "splice"])
def test_planted_faults_are_found_and_nothing_else_is_told(kind):
    rng = np.random.default_rng(len(kind))
    days = [n for n in recordings() if n not in (SPLICED, "spindle")]
    found = further = 0
    for _ in range(CASES):
        name = str(rng.choice(days))
        run = recordings()[name]
        damage, channel = planted(kind, rng, float(rng.uniform(0.4, 0.9)) * 3600.0)
        line = int(np.searchsorted(run.temperatures.time, damage.start))
        new = [f for f in faults_of(damaged(run, damage)) if f.kind != "stuck"]
        right = [f for f in new if f.kind == kind and abs(f.first_row - line) <= 1]
        found += any(kind == "splice" or f.channels == (channel,) for f in right)
        further += len(new) - len(right)
    assert found >= CASES - 1
    assert further <= 1
