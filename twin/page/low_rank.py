"""A field at many times in few modes: what makes every step of a run fit into one file.

field(t) = modes @ weights(t), by the singular value decomposition, as few modes as a stated error allows. Modes are
stored as 16-bit integers with a scale each. Pictures at a few times were rejected: between them there is nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from twin.page.packed import packed

LARGEST = 32767  # of a 16-bit integer
RMS = 0.25  # of the tolerance: where the search for the number of modes begins


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
        return self.modes.astype(float) @ self.weights


def low_rank(field: np.ndarray, tolerance: float) -> LowRank:
    """The field (m, n) within `tolerance` (its unit), as far as 16 bits go."""
    if not field.size:
        return LowRank(np.zeros((len(field), 0), dtype=np.int16), np.zeros((0, field.shape[1])), 0.0)
    tall = field.shape[0] >= field.shape[1]
    squares, vectors = np.linalg.eigh(field.T @ field if tall else field @ field.T)  # the smaller of both products
    squares, vectors = np.maximum(squares[::-1], 0.0), vectors[:, ::-1]
    beyond = np.sqrt(np.append(squares[::-1].cumsum()[::-1], 0.0) / field.size)  # rms of what so many modes leave
    for count in range(int(np.argmax(beyond <= RMS * tolerance)), len(squares) + 1):
        kept = vectors[:, :count]
        left, right = (field @ kept, kept.T) if tall else (kept, kept.T @ field)
        scale = np.maximum(np.abs(left).max(axis=0), np.finfo(float).tiny) / LARGEST
        found = LowRank(np.round(left / scale).astype(np.int16), scale[:, None] * right, 0.0)
        error = float(np.abs(field - found()).max())
        if error <= tolerance or count == len(squares):
            return replace(found, error=error)
    raise AssertionError("the last count returns")
