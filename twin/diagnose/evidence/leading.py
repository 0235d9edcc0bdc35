"""Few columns for many: the leading directions of what a nuisance may do, of all channels or of each."""

from __future__ import annotations

import numpy as np

from twin.diagnose.model.study import Study

LEAST = 0.7  # standard deviations over all its rows that a direction must have


def leading(white: np.ndarray) -> np.ndarray:
    """(m, k) the leading directions of white columns (m, n) of unit prior variance: nearly the same covariance."""
    U, s, _ = np.linalg.svd(white, full_matrices=False)
    kept = s > LEAST
    return np.asarray(U[:, kept] * s[kept])


def leading_of_each(channel: np.ndarray, white: np.ndarray) -> np.ndarray:
    """(m, k) the same of every channel by itself; channel (m,) 0, 1, ..."""
    made = []
    for own in np.unique(channel):
        rows = np.flatnonzero(channel == own)
        directions = leading(white[rows])
        made.append(np.zeros((len(white), directions.shape[1])))
        made[-1][rows] = directions
    return np.hstack(made)


def channel_of(study: Study) -> np.ndarray:
    """(m,) which channel every number is of: sensors by number, TCP components -1 to -3."""
    return study.joined(lambda p: (p.measured.column, [-1, -2, -3]))
