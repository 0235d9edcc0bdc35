"""What a model that is wrong in its form leaves, as model discrepancy of its own: a slow error of every channel.

What such a model leaves lasts for hours, is far larger in some channels than in others, and is no noise. Of the white
numbers w of a channel in a run, less what calibration explains, mean square and product of neighbours say

    cov(w_i, w_j) = [i = j] + v rho^|i - j|,    v = <w_i^2> - 1,    v rho = <w_i w_(i+1)>

a first-order autoregression beside the noise. Its leading modes become nuisances (`twin.diagnose.evidence.whiten`): a
cause then counts by what slow errors of single channels could not imitate (estimated generalised least squares: Greene,
Econometric Analysis, 2012, section 9.3; a model discrepancy, Kennedy, O'Hagan, J. R. Statist. Soc. B 63, 2001, learned
from what is left).

A cause that is hidden in what is left makes slow errors large, and hides itself: so they are learned twice, the second
time beside what explains most beside the first ones.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.diagnose.evidence.fitter import Fitted
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.policy import POLICY, SearchPolicy


def slow_errors(detector: Detector, fitted: Fitted) -> np.ndarray:
    """(m, q) white, each of unit prior variance: what a fit has left, as slow errors of single channels."""
    study, first = detector.study, 0
    left = fitted.projector(detector.whiten(fitted.residual))
    measured, blocks = np.isfinite(fitted.residual), [np.zeros((len(left), 0))]
    for k in study.fitted:
        (bins, sensors), (rows, _) = study.runs[k].shapes
        for start, n, channels in ((first, bins, sensors), (first + bins * sensors, rows, 3)):
            for c in range(channels):
                at = start + np.arange(n) * channels + c
                at = at[measured[at]]
                modes = modes_of(left[at], detector.policy)
                block = np.zeros((len(left), modes.shape[1]))
                block[at] = modes
                blocks.append(block)
        first += study.runs[k].size
    return np.hstack(blocks)


def modes_of(left: np.ndarray, policy: SearchPolicy = POLICY) -> np.ndarray:
    """(n, q) of the white numbers (n,) that are left of a channel in a run."""
    n = len(left)
    more = float(left @ left) / max(n, 1) - 1.0
    if n < policy.slow_rows or more <= 0.0:
        return np.zeros((n, 0))
    rho = float(np.clip(left[1:] @ left[:-1] / ((n - 1) * more), 0.0, policy.slow_longest))
    variance, modes = np.linalg.eigh(more * rho ** np.abs(np.subtract.outer(np.arange(n), np.arange(n))))
    kept = variance > policy.slow_least
    return np.asarray(modes[:, kept] * np.sqrt(variance[kept]))


def with_errors(detector: Detector, errors: np.ndarray) -> Detector:
    """The detector of a poor model: with slow errors (m, q) in its model discrepancy."""
    others = np.hstack([detector.fitter.others, errors])
    fitter = replace(detector.fitter, others=others)
    return replace(detector, fitter=fitter, columns=detector.columns.beside(others), poor=True)
