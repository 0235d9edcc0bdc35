"""Residuals in units of what cannot be explained: noise with memory, model discrepancy, and everything calibratable.

With nuisance columns N (parameters, sensor offsets, modes of model discrepancy, each in prior standard deviations) the
marginal covariance of a white residual r is 1 + N N^T, and

    (1 + N N^T)^-1 = 1 - N (1 + N^T N)^-1 N^T =: Pi

is what every statistic is made with: a hypothesis counts only by what no calibration could imitate (Woodbury 1950;
Rasmussen, Williams, Gaussian Processes for Machine Learning, 2006, section 2.7, on explicit bases with priors).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg

from twin.calibrate.fit.noise import Channels
from twin.diagnose.model.study import Study

ROUNDING = 1e-10  # of what data say of a nuisance, by which it is held where it is another one to rounding


@dataclass(frozen=True)
class Whitener:
    """Channels per fitted run: of sensors (s) and of TCP components (3)."""

    study: Study
    channels: tuple[tuple[Channels, Channels], ...]
    weight: np.ndarray | None = None  # (m,) of every number; None: all alike

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """values (m, ...) of all fitted runs, one after the other -> the same, of unit variance.

        What the study did not measure yields zero, in data and responses alike, and so does NaN.
        """
        lost = missing(self.study)
        if lost.any():
            values = np.where(lost.reshape(-1, *([1] * (values.ndim - 1))), np.nan, values)
        parts, rest = [], values.shape[1:]
        for (planned, T, w), (sensors, tcp) in zip(self.study.split(values), self.channels, strict=True):
            weight = planned.measured.row_weight(float(np.median(tcp.sigma))).reshape(-1, 1, *([1] * len(rest)))
            white = sensors.whiten(T), tcp.whiten(w * weight)
            parts += [v.reshape(v.shape[0] * v.shape[1], *rest) for v in white]  # no sensors: nothing for -1 to count
        result = np.concatenate(parts)
        return result if self.weight is None else result * self.weight.reshape(-1, *([1] * len(rest)))

    def colour(self, white: np.ndarray) -> np.ndarray:
        """White values (m,) back in their units, of channels without memory that weigh alike; NaN where nothing
        was measured."""
        parts = []
        for (_, T, w), (sensors, tcp) in zip(self.study.split(white), self.channels, strict=True):
            parts += [(T * sensors.sigma).ravel(), (w * tcp.sigma).ravel()]
        return np.where(missing(self.study), np.nan, np.concatenate(parts))


@dataclass(frozen=True)
class Projector:
    """Pi for nuisance columns N (m, q) of unit prior variance."""

    blocks: tuple[np.ndarray, ...]  # of columns of N; side by side only where all are asked for
    factor: tuple[np.ndarray, bool]  # Cholesky of 1 + N^T N

    @classmethod
    def of(cls, *blocks: np.ndarray, gram: np.ndarray | None = None) -> Projector:
        """From the columns; gram: N^T N, where it is known."""
        known = np.block([[a.T @ b for b in blocks] for a in blocks]) if gram is None else gram
        precision = np.eye(len(known)) + known
        try:
            factor = scipy.linalg.cho_factor(precision, lower=True)
        except np.linalg.LinAlgError:  # columns alike to rounding, of measurements beyond all reason
            factor = scipy.linalg.cho_factor(precision + ROUNDING * np.diag(np.diag(known)), lower=True)
        return cls(blocks, factor)

    @cached_property
    def N(self) -> np.ndarray:
        return self.blocks[0] if len(self.blocks) == 1 else np.hstack(self.blocks)

    def __call__(self, white: np.ndarray) -> np.ndarray:
        """Pi @ white (m, ...)."""
        return white - self.outputs(self.most_likely(white))

    def most_likely(self, white: np.ndarray) -> np.ndarray:
        """(q, ...) coordinates of the nuisance in white (m, ...)."""
        return np.asarray(scipy.linalg.cho_solve(self.factor, self.seen(white)))

    def seen(self, white: np.ndarray) -> np.ndarray:
        """(q, ...) N^T @ white (m, ...)."""
        return np.concatenate([block.T @ white for block in self.blocks])

    def outputs(self, coordinates: np.ndarray) -> np.ndarray:
        """(m, ...) N @ coordinates (q, ...)."""
        ends = np.cumsum([block.shape[1] for block in self.blocks])
        return np.asarray(sum(b @ own for b, own in zip(self.blocks, np.split(coordinates, ends[:-1]), strict=True)))


def missing(study: Study) -> np.ndarray:
    """(m,) bool: what was not measured in the fitted runs."""
    return ~np.isfinite(measured_of(study))


def measured_of(study: Study) -> np.ndarray:
    """(m,) what was measured in the fitted runs, NaN where nothing was."""
    return study.joined(lambda p: (p.measured.temperature, p.measured.tcp))


def offsets(study: Study) -> tuple[np.ndarray, tuple[str, ...]]:
    """(m, s) 1 K on one sensor in all fitted runs, and the names of these sensors."""
    names = tuple(dict.fromkeys(s for k in study.fitted for s in study.runs[k].measured.sensors))
    number = study.joined(lambda p: ([names.index(name) for name in p.measured.sensors], -1))
    return (number[:, None] == np.arange(len(names))).astype(float), names
