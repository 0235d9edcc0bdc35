"""The calibration that is delivered: parameters that predict, with and without the causes that were named.

What finds causes weighs residuals by all that model discrepancy can do, and leaves to it what it can explain: right for
tests, but a model that keeps its parameters and forgets that discrepancy predicts badly. Here model discrepancy is
noise that lasts as long as a run: a channel of a run counts about once, however often it was read, and the rest is
left to the tolerances. The fit begins at the description, so that of two calibrations alike the nearer one is taken.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.diagnose.accepted import Accepted, exchanged, freed, read_change, stepped, with_shifts
from twin.diagnose.detector import Detector
from twin.diagnose.fitter import CLOSE, bounds
from twin.diagnose.study import Study

PASSES, INNER = 3, 6
LONGEST = 1.0  # prior standard deviations, of a step


def settled(detector: Detector, y: np.ndarray, accepted: Sequence[Accepted]) -> tuple[np.ndarray, np.ndarray]:
    """Parameters (n,) in prior standard deviations of measurements y (m,), and their covariance (n, n).

    Amplitudes of the accepted causes stay as they are. The covariance counts model discrepancy as what it is:
    A (1 + J^T W (1 + N N^T) W J) A with A = (1 + J^T W J)^-1 (White, Econometrica 48, 1980, on such sandwiches).
    """
    study, surrogate, whiten = detector.study, detector.fitter.surrogate, detector.whiten
    low, high = bounds(study)
    N = detector.fitter.others
    W = 1.0 / (1.0 + _rows(study) * (N**2).sum(axis=1))
    y = exchanged(study, y, accepted)
    reading = [a for a in accepted if not a.units and a.hypothesis.batch.kind != "gain"]
    held = [j for a in accepted for j in freed(study, a.hypothesis)]
    x = np.zeros(len(low))
    for _ in range(PASSES):
        before = x
        there = with_shifts(study, accepted, x)
        read = np.zeros(len(y))
        for a in reading:
            read += read_change(detector, a.hypothesis, a.amplitude, there)
        beside = np.concatenate([stepped(detector, accepted, k, there) for k in study.fitted]) - surrogate.at(there)[0]
        for _ in range(INNER):
            f, J = surrogate.at(with_shifts(study, accepted, x))
            J[:, held] = 0.0
            white = whiten(J)
            A = np.linalg.inv(np.eye(len(x)) + white.T @ (W[:, None] * white))
            found = A @ (white.T @ (W * (whiten(y - f - beside + J @ x) - read)))
            step = np.clip(np.clip(found, low, high) - x, -LONGEST, LONGEST)
            x = x + step
            if np.abs(step).max(initial=0.0) < CLOSE:
                break
        if np.abs(x - before).max(initial=0.0) < 3 * CLOSE:
            break
    weighted = W[:, None] * white
    crossed = N.T @ weighted
    return x, A @ (np.eye(len(x)) + weighted.T @ weighted + crossed.T @ crossed) @ A


def _rows(study: Study) -> np.ndarray:
    """(m,) how many numbers the channel of each number has in its run."""
    parts = []
    for k in study.fitted:
        (bins, sensors), (rows, _) = study.runs[k].shapes
        parts += [np.full(bins * sensors, float(bins)), np.full(3 * rows, float(rows))]
    return np.concatenate(parts) if parts else np.zeros(0)
