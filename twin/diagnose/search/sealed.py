"""The sealed runs judge the headline: what names a cause in the machine must predict runs that were not looked at.

It never makes a name: a sensor fault, or an event of the runs that were looked at, shows in no other run. But a cause
of the machine that makes more of the channels that it moves worse than better, beyond chance, has explained the runs
that were looked at and not the machine, and its name is withdrawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.calibrate.fit.measured import Measured
from twin.diagnose.faults.fault import Family
from twin.diagnose.result.diagnosis import Cause, Gain, Verdict
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.gain import gains
from twin.diagnose.search.look import Search
from twin.diagnose.search.verdict import CALIBRATED


@dataclass(frozen=True)
class Judged:
    """A headline after the sealed runs were opened."""

    verdict: Verdict
    causes: tuple[Cause, ...]
    extension: tuple[Cause, ...]  # what belongs into the description
    gains: tuple[Gain, ...]
    note: str = ""  # why a name was withdrawn


def judged(
    found: Search, verdict: Verdict, causes: Sequence[Cause], families: Sequence[Family], opened: Sequence[Measured],
    seed: int,
) -> Judged:  # fmt: skip
    """The headline of a search, held against the measurements of the sealed runs, the last ones of its study."""
    entries = {f.name: f for f in families}
    named = verdict in ("named", "out_of_tolerance", "ambiguous", "signal")
    extension = tuple(
        c for c in causes
        if named and c.history != CALIBRATED and c.family in entries and entries[c.family].changes(c)
    )  # fmt: skip
    first = len(found.detector.study.runs) - len(opened)
    table = tuple(
        g for k, m in enumerate(opened, start=first) for g in gains(found, k, m, seed, _noise(found.detector, m))
    )  # fmt: skip
    moved = [g for g in table if g.affected]
    worse = [g for g in moved if g.ci95[1] < 0.0]
    if not extension or len(worse) <= sum(g.ci95[0] > 0.0 for g in moved):
        return Judged(verdict, tuple(causes), extension, table)
    names = " and ".join(dict.fromkeys(f"{c.family.replace('_', ' ')} at {c.place}" for c in extension))
    note = (
        f"withdrawn: {names}. It explains the runs that were looked at, and on the sealed run it makes {len(worse)} of "
        f"the {len(moved)} channels that it moves worse beyond chance"
    )
    return Judged("unknown", tuple(c for c in causes if c not in extension), (), table, note)


def _noise(detector: Detector, m: Measured) -> tuple[np.ndarray, np.ndarray]:
    """Of a sealed run's sensors (s,) and TCP components (3,): as in the first fitted run."""
    sensors, tcp = detector.whiten.channels[0]
    own = detector.study.runs[0].measured.sensors
    known = dict(zip(own, sensors.sigma, strict=True))
    return np.array(
        [known.get(s, float(np.median(sensors.sigma)) if len(own) else detector.policy.thermocouple) for s in m.sensors]
    ), tcp.sigma
