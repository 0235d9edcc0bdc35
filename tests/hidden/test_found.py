"""Effects hidden in data must be found: `twin diagnose` gets the nominal machine and the runs, nothing else.

Truth is the full model of another machine (`tests.hidden.trials`). The yardstick of the nominal machine is made once,
minutes on two cores, and kept in the cache folder.
"""

from __future__ import annotations

import fcntl

import numpy as np
import pytest

from tests.hidden.load import MODEL
from tests.hidden.trials import TRIALS, trial
from twin.build.cache import folder
from twin.calibrate.measured import measured
from twin.diagnose.catalogue import FAMILIES
from twin.diagnose.channels_check import stuck_sensors
from twin.diagnose.diagnose import Settings, prepare
from twin.diagnose.diagnosis import Cause, Verdict
from twin.diagnose.search import Search, search
from twin.diagnose.study import with_measured
from twin.diagnose.verdict import limits_of, unknown_of, verdict_of
from twin.diagnose.whiten import measured_of
from twin.diagnose.yardstick import Yardstick
from twin.machine.load import load_machine

SETTINGS = Settings(temperature_sigma=0.08, form=30, nulls=40)


@pytest.fixture(scope="session")
def yardstick() -> Yardstick:
    machine = load_machine(MODEL)
    runs, _ = trial("null_0")
    folder().mkdir(parents=True, exist_ok=True)
    with (folder() / "yardstick.lock").open("w") as lock:  # one process makes it, the others wait
        fcntl.flock(lock, fcntl.LOCK_EX)
        return prepare(None, machine, runs[:2], runs[2:], SETTINGS)[2]


def diagnosed(yard: Yardstick, name: str) -> tuple[Search, Verdict, tuple[Cause, ...]]:
    runs, _ = trial(name)
    study = yard.study
    usable, stuck = stuck_sensors(runs[:2], study.bench.base.sensors, [p.run.name for p in study.runs[:2]])
    plans = [
        measured(study.bench.base, run, p.run.drive, p.run.name)
        for run, p in zip([*usable, runs[2]], study.runs, strict=True)
    ]
    found = search(yard, measured_of(with_measured(study, plans)))
    verdict, causes = verdict_of(found, FAMILIES)
    if stuck:
        return found, "sensor" if verdict == "nothing" else verdict, (*stuck, *causes)
    return found, verdict, causes


# What today's search does not say as it should; strict: mend one, and its line has to go.
MISSED: dict[str, str] = {}


def _same(said: str, wanted: str) -> bool:
    """Same place, or the same part."""
    return said == wanted or said.split(".")[0] == wanted.split(".")[0] not in ("films", "contacts", "sources", "tcp")


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(n, marks=pytest.mark.xfail(reason=MISSED[n], strict=True)) if n in MISSED else n
        for n in TRIALS
        if n != "coarse_model"
    ],
)
def test_what_was_hidden_is_said(yardstick, name):
    _, expected = trial(name)
    found, verdict, causes = diagnosed(yardstick, name)
    said = [(c.family, c.place) for c in causes]
    assert verdict in expected.verdicts, (verdict, said)
    if verdict == "unknown" and expected.place:
        unknown = unknown_of(found)
        assert unknown is not None
        assert _same(unknown.part, expected.place)
    if expected.family and verdict != "nothing":
        assert any(
            family in (expected.family, *expected.families)
            and any(_same(place, wanted) for wanted in (expected.place, *expected.places))
            for family, place in said
        ), said


def test_what_is_too_small_is_below_its_limit(yardstick):
    """Nothing is said of 0.7 W, and the report says that 0.7 W would not have been seen."""
    _, expected = trial("below_limit")
    limits = [limit for limit in limits_of(yardstick) if limit.family == expected.family]
    assert limits
    assert np.all([limit.smallest > expected.size for limit in limits])
