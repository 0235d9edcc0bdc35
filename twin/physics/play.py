"""The play operator: what follows a motion through a clearance, and stays while the clearance is crossed."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def play(motion: ArrayLike, width: float) -> np.ndarray:
    """(n,) where that stands which follows a motion (n,) through a play of `width`, in the motion's unit.

    It starts at the motion's first value and is moved only where a flank touches it: |follower - motion| <= width / 2.
    Source: the play operator of A. Visintin, Differential Models of Hysteresis, Springer 1994.
    """
    values = np.asarray(motion, dtype=float)
    follower, half = np.empty_like(values), width / 2
    for k, value in enumerate(values):
        at = value if k == 0 else follower[k - 1]
        follower[k] = min(max(at, value - half), value + half)
    return follower
