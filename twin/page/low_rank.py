"""A field at many times in few modes: what makes every step of a run fit into one file.

field(t) = modes @ weights(t), by the singular value decomposition, as few modes as a stated error allows. Modes are
stored as 16-bit integers with a scale each. Pictures at a few times were rejected: between them there is nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.page.packed import packed

LARGEST = 32767  # of a 16-bit integer


@dataclass(frozen=True)
class LowRank:
    """A field of m values at n times."""

    modes: np.ndarray  # (m, r) int16
    weights: np.ndarray  # (r, n) unit of the field per count of a mode
    error: float  # largest difference from the field, its unit

    def told(self) -> dict[str, Any]:
        """As JSON: modes (r, m), weights (n, r)."""
        return {"modes": packed(self.modes.T, "i2"), "weights": packed(self.weights.T)}

    def __call__(self) -> np.ndarray:
        """(m, n)"""
        return self.modes @ self.weights


def low_rank(field: np.ndarray, tolerance: float) -> LowRank:
    """The field (m, n) within `tolerance` (its unit), as far as 16 bits go."""
    tall = field.shape[0] >= field.shape[1]
    _, vectors = np.linalg.eigh(field.T @ field if tall else field @ field.T)  # the smaller of both products
    vectors = vectors[:, ::-1]
    left, right = (field @ vectors, vectors.T) if tall else (vectors, vectors.T @ field)
    modes = np.zeros((len(field), 0), dtype=np.int16)
    weights = np.zeros((0, field.shape[1]))
    rest = np.array(field, dtype=float)
    for k in range(vectors.shape[1]):
        if not rest.size or np.abs(rest).max() <= tolerance:
            break
        largest = float(np.abs(left[:, k]).max())
        if not largest > 0.0:
            break
        mode = np.round(left[:, k] * (LARGEST / largest)).astype(np.int16)
        weight = right[k] * (largest / LARGEST)
        rest -= np.outer(mode, weight)
        modes, weights = np.column_stack([modes, mode]), np.vstack([weights, weight])
    return LowRank(modes, weights, float(np.abs(rest).max(initial=0.0)))
