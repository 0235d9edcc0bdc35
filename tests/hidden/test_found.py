"""Effects hidden in data must be found: `twin diagnose` gets the nominal machine and the runs, nothing else.

Truth is the full model of another machine (`tests.hidden.trials`). The yardstick of the nominal machine is made once,
minutes on two cores, and kept in the cache folder.
"""

from __future__ import annotations

import fcntl

import pytest

from tests.hidden.load import MODEL
from tests.hidden.trials import trial
from twin.build.cache import folder
from twin.calibrate.measured import measured
from twin.diagnose.catalogue import FAMILIES
from twin.diagnose.channels_check import stuck_sensors
from twin.diagnose.diagnose import Settings, prepare
from twin.diagnose.diagnosis import Cause, Verdict
from twin.diagnose.search import Search, search
from twin.diagnose.study import with_measured
from twin.diagnose.verdict import verdict_of
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
