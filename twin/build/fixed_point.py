"""Fixed points x = g(x) of an expensive g by Anderson acceleration."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from twin.errors import ModelError

MEMORY = 6  # differences that the least squares look back on
DAMPING = 0.3  # of a turn after a restart


def fixed_point(
    g: Callable[[np.ndarray], np.ndarray],
    start: np.ndarray,
    size: Callable[[np.ndarray], float],
    tolerance: float,
    most: int,
) -> np.ndarray:
    """x (n,) with size(g(x) - x) <= tolerance, from `start` (n,).

    Anderson acceleration (Walker, Ni, SIAM J. Numer. Anal. 49, 2011, type II), restarted from the best state with a
    damped turn where the residual grows tenfold. Raises ModelError after `most` turns.
    """
    x = start
    steps: list[np.ndarray] = []  # differences of states
    changes: list[np.ndarray] = []  # and of residuals
    best, best_x, last = np.inf, start, None
    damping = 1.0
    for _ in range(most):
        residual = g(x) - x
        now = size(residual)
        if now <= tolerance:
            return x + residual
        if now < best:
            best, best_x, best_residual = now, x, residual
        elif now > 10.0 * best or not np.isfinite(now):
            damping = max(DAMPING * damping, 1e-3)
            steps, changes, last = [], [], None
            x = best_x + damping * best_residual
            continue
        if last is not None:
            steps.append(x - last[0])
            changes.append(residual - last[1])
            steps, changes = steps[-MEMORY:], changes[-MEMORY:]
        last = (x, residual)
        if steps:
            dX, dR = np.column_stack(steps), np.column_stack(changes)
            weight, *_ = np.linalg.lstsq(dR, residual, rcond=1e-10)
            x = x + damping * residual - (dX + damping * dR) @ weight
        else:
            x = x + damping * residual
    raise ModelError(
        f"no steady state within {most} turns (the last one moved {now:.2g} K)",
        "laws that follow temperatures",
        "a loss that grows with temperature may run away: check its parameters and the ranges of its signals",
    )
