"""Causes as witnesses: a channel that all others refute is at no fault where what was found in these explains it.

A joint that is lost beside one sensor moves that one far from all others: neither these nor the calibrated model know
why. Its readings are set aside, and the others tell the joint all the same. What the model predicts with that is asked
then; where it is nearer to the readings than to these less the fault, they count again, and the search begins anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twin.calibrate.channels.finding import Finding
from twin.calibrate.channels.judge import Judgement
from twin.calibrate.fit.measured import measured
from twin.diagnose.search.accepted import acting, with_shifts
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.dispersion import Dispersion, searched
from twin.diagnose.search.look import Search
from twin.diagnose.search.witness import Measurements, measurements, nearer_corrected, other_measurements
from twin.logs.run import Run


def excused(found: Search, runs: Sequence[Run], judgement: Judgement) -> Judgement:
    """What is left of a judgement beside what a search has found in the other readings; runs: the fitted ones, as they
    were measured."""
    base = found.detector.study.probed.base
    known = set(base.sensors) - set(dict(base.ambient_sensors))
    asked = [f for f in judgement.findings if f.sized and np.isfinite(f.statistic) and f.channels[0] in known]
    if not asked or not any(a.units for a in found.accepted):
        return judgement
    gone = [f for f in asked if not _stands(found, runs, f)]
    return replace(judgement, findings=tuple(f for f in judgement.findings if f not in gone))


def other_search(detector: Detector, runs: Sequence[Run]) -> tuple[Search, Dispersion, Measurements]:
    """What is found in other measurements of the runs that a detector was made for, sealed ones last. For campaigns."""
    own = other_measurements(detector, runs)
    found, left = searched(own.detector, own.y)
    kept = excused(found, runs[: len(detector.study.fitted)], own.judgement)
    if len(kept.findings) < len(own.judgement.findings):
        own = measurements(detector, runs, kept)
        found, left = searched(own.detector, own.y)
    return found, left, own


def _stands(found: Search, runs: Sequence[Run], f: Finding) -> bool:
    """Whether the readings of a finding's channel less its fault are nearer to what is predicted with all causes."""
    study, detector, name = found.detector.study, found.detector, f.channels[0]
    x, off = with_shifts(study, found.accepted, found.x), list[tuple[int, np.ndarray, np.ndarray]]()
    for number, k in enumerate(study.fitted):
        planned = study.runs[k]
        raw = measured(study.probed.base, runs[number], planned.run.drive, planned.measured.name)
        if name in raw.sensors:
            read = replace(study, runs=tuple(replace(p, measured=raw) if p is planned else p for p in study.runs))
            T, _ = read.runs[k].split(read.outputs(k, x, *acting(detector, found.accepted, k)))
            j = raw.sensors.index(name)
            off.append((number, raw.bin_time, raw.temperature[:, j] - T[:, j]))
    return nearer_corrected(off, f)
