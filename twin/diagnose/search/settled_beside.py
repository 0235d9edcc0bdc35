"""The delivered calibration beside causes that were named: their amplitudes stay as they are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.diagnose.evidence.settled import settle, settled_alone
from twin.diagnose.faults.table import fault_of
from twin.diagnose.search.accepted import Accepted, exchanged, freed, read_change, stepped, with_shifts
from twin.diagnose.search.detector import Detector


def settled(detector: Detector, y: np.ndarray, accepted: Sequence[Accepted]) -> tuple[np.ndarray, np.ndarray]:
    """Parameters (n,) in prior standard deviations of measurements y (m,), and their covariance (n, n)."""
    if not accepted:
        return settled_alone(detector.fitter, y)
    study, surrogate = detector.study, detector.fitter.surrogate
    y = exchanged(study, y, accepted)
    reading = [a for a in accepted if not a.units and not fault_of(a.hypothesis).parameter]
    held = [j for a in accepted for j in freed(study, a.hypothesis)]

    def outputs(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        f, J = surrogate.at(with_shifts(study, accepted, x))
        J[:, held] = 0.0
        return f, J

    def left(x: np.ndarray) -> np.ndarray:
        there = with_shifts(study, accepted, x)
        read = np.zeros(len(y))
        for a in reading:
            read += read_change(detector, a.hypothesis, a.amplitude, there)
        exact = np.concatenate([stepped(detector, accepted, k, there) for k in study.fitted])
        return detector.whiten(y - exact) - read

    return settle(detector.fitter, outputs, left)
