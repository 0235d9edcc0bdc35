"""Linear regression with ridge, its strength chosen by cross-validation inside the training data alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.errors import ModelError

STRENGTHS = np.logspace(-6.0, 3.0, 28)  # of the mean squared standardised input
FOLDS = 5


@dataclass(frozen=True)
class Ridge:
    """y = offset + x @ weights."""

    weights: np.ndarray  # (f, c) units of y per unit of x
    offset: np.ndarray  # (c,)
    strength: float  # chosen, of `STRENGTHS`

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """(n, c) for inputs (n, f)."""
        return self.offset + np.asarray(x) @ self.weights


def fit_ridge(x: np.ndarray, y: np.ndarray, groups: np.ndarray | None = None) -> Ridge:
    """Ridge from inputs x (n, f) to y (n,) or (n, c), all finite; minimises |y - offset - x w|² + n s |D w|².

    D: standard deviations of the inputs. The strength s is the one that predicts left-out groups best. groups (n,):
    the test each row is of; with one only, FOLDS stretches of consecutive rows, for neighbours in time know each other.

    Raises ModelError for fewer than two rows.
    """
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    y = y[:, None] if y.ndim == 1 else y
    if len(x) < 2:
        raise ModelError(f"{len(x)} measurements to train a regression with", "", "give longer runs with --train")
    if groups is None or len(np.unique(groups)) < 2:
        groups = np.arange(len(x)) * min(FOLDS, len(x)) // len(x)
    error = np.zeros(len(STRENGTHS))
    for group in np.unique(groups):
        out = groups == group
        for k, (weights, offset) in enumerate(_path(x[~out], y[~out], STRENGTHS)):
            error[k] += np.sum((y[out] - offset - x[out] @ weights) ** 2)
    best = float(STRENGTHS[int(np.argmin(error))])
    ((weights, offset),) = _path(x, y, np.array([best]))
    return Ridge(weights, offset, best)


def _path(x: np.ndarray, y: np.ndarray, strengths: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Weights (f, c) and offset (c,) for each strength, from one singular value decomposition."""
    mean, scale, level = x.mean(axis=0), x.std(axis=0), y.mean(axis=0)
    scale = np.where(scale > 1e-12 * np.maximum(np.abs(mean), 1e-300), scale, np.inf)  # a constant tells nothing
    left, s, right = np.linalg.svd((x - mean) / scale, full_matrices=False)
    projected = left.T @ (y - level)
    found = []
    for strength in strengths:
        weights = (right.T @ ((s / (s**2 + len(x) * strength))[:, None] * projected)) / scale[:, None]
        found.append((weights, level - mean @ weights))
    return found
