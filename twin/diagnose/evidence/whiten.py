"""Residuals in units of what cannot be explained: noise with memory, model discrepancy, and everything calibratable.

With white residual r, nuisance columns N (parameters and sensor offsets in prior standard deviations, modes
of model discrepancy in theirs) the marginal covariance of r is 1 + N N^T, and

    (1 + N N^T)^-1 = 1 - N (1 + N^T N)^-1 N^T =: Pi

is what every statistic is made with: a hypothesis counts only by what no calibration could imitate (Woodbury 1950;
Rasmussen, Williams, Gaussian Processes for Machine Learning, 2006, section 2.7, on explicit bases with priors).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from twin.calibrate.fit.noise import Channels
from twin.diagnose.model.study import Study


@dataclass(frozen=True)
class Whitener:
    """Channels per fitted run: of sensors (s) and of TCP components (3)."""

    study: Study
    channels: tuple[tuple[Channels, Channels], ...]

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """values (m, ...) of all fitted runs, one after the other -> the same, of unit variance.

        What the study did not measure yields zero, in data and responses alike, and so does NaN.
        """
        lost = missing(self.study)
        if lost.any():
            values = np.where(lost.reshape(-1, *([1] * (values.ndim - 1))), np.nan, values)
        parts, first = [], 0
        for k, (sensors, tcp) in zip(self.study.fitted, self.channels, strict=True):
            planned = self.study.runs[k]
            T, w = planned.split(values[first : first + planned.size])
            rest = values.shape[1:]
            weight = planned.measured.row_weight(float(np.median(tcp.sigma))).reshape(-1, 1, *([1] * len(rest)))
            white = sensors.whiten(T), tcp.whiten(w * weight)
            parts += [v.reshape(v.shape[0] * v.shape[1], *rest) for v in white]  # no sensors: nothing for -1 to count
            first += planned.size
        return np.concatenate(parts)

    def colour(self, white: np.ndarray) -> np.ndarray:
        """White values (m,) back in their units, of channels without memory; NaN where nothing was measured."""
        parts, first = [], 0
        for k, (sensors, tcp) in zip(self.study.fitted, self.channels, strict=True):
            planned = self.study.runs[k]
            T, w = planned.split(white[first : first + planned.size])
            parts += [(T * sensors.sigma).ravel(), (w * tcp.sigma).ravel()]
            first += planned.size
        return np.where(missing(self.study), np.nan, np.concatenate(parts))


@dataclass(frozen=True)
class Projector:
    """Pi for nuisance columns N (m, q) of unit prior variance."""

    N: np.ndarray
    factor: tuple[np.ndarray, bool]  # Cholesky of 1 + N^T N

    @classmethod
    def of(cls, N: np.ndarray, gram: np.ndarray | None = None) -> Projector:
        """From the columns; gram: N^T N, where it is known."""
        known = N.T @ N if gram is None else gram
        return cls(N, scipy.linalg.cho_factor(np.eye(N.shape[1]) + known, lower=True))

    def __call__(self, white: np.ndarray) -> np.ndarray:
        """Pi @ white (m, ...)."""
        return np.asarray(white - self.N @ scipy.linalg.cho_solve(self.factor, self.N.T @ white))

    def most_likely(self, white: np.ndarray) -> np.ndarray:
        """(q,) coordinates of the nuisance in white (m,)."""
        return np.asarray(scipy.linalg.cho_solve(self.factor, self.N.T @ white))


def missing(study: Study) -> np.ndarray:
    """(m,) bool: what was not measured in the fitted runs."""
    return ~np.isfinite(measured_of(study))


def measured_of(study: Study) -> np.ndarray:
    """(m,) what was measured in the fitted runs, NaN where nothing was."""
    parts = []
    for k in study.fitted:
        m = study.runs[k].measured
        parts += [m.temperature.ravel(), m.tcp.ravel()]
    return np.concatenate(parts) if parts else np.zeros(0)


def labels(study: Study) -> np.ndarray:
    """(m,) which channel every number of the fitted runs is of: sensors by number, then the TCP components."""
    parts = []
    for k in study.fitted:
        (b, _), (rows, _) = study.runs[k].shapes
        parts += [
            np.tile(study.runs[k].measured.column, b),
            len(study.probed.base.sensors) + np.tile(np.arange(3), rows),
        ]
    return np.concatenate(parts) if parts else np.zeros(0, dtype=int)


def offsets(study: Study) -> tuple[np.ndarray, tuple[str, ...]]:
    """(m, s) 1 K on one sensor in all fitted runs, and the names of these sensors."""
    names = tuple(dict.fromkeys(s for k in study.fitted for s in study.runs[k].measured.sensors))
    blocks = []
    for k in study.fitted:
        planned = study.runs[k]
        block = np.zeros((planned.size, len(names)))
        (b, s), _ = planned.shapes
        for i, name in enumerate(planned.measured.sensors):
            block[np.arange(b) * s + i, names.index(name)] = 1.0
        blocks.append(block)
    return np.vstack(blocks) if blocks else np.zeros((0, 0)), names
