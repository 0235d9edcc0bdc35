"""Heat of any history at one place, in blocks of five minutes.

`twin.diagnose.evidence.unknown` looks at every part in blocks of an hour, which does not follow what switches within
one. Here heat has the covariance of an Ornstein-Uhlenbeck process,

    sigma^2 exp(-|t - t'| / tau),

which may leap as a switch does, and the evidence is the same (Rasmussen, Williams 2006, eq 2.30 and 4.9).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from twin.calibrate.fit.measured import BIN
from twin.diagnose.evidence.whiten import Projector

BLOCK = BIN  # s: means over bins tell nothing shorter
MEMORIES = (600.0, 1800.0, 7200.0)  # s, tau: from two blocks to two hours, as by the hour
SIGMAS = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0)  # W


@dataclass(frozen=True)
class AnyHistory:
    """Heat at a place, in b blocks."""

    evidence: float  # twice the logarithm of that against no heat
    heat: np.ndarray  # (b,) W, most likely
    sigma: np.ndarray  # (b,) W
    responses: np.ndarray  # (m, b) white, to amplitudes of unit prior variance


def any_history(
    D: np.ndarray, blocks: Sequence[tuple[int, float]], projector: Projector, white: np.ndarray
) -> AnyHistory:
    """The most likely of all variances and memories; D (m, b) white responses to 1 W in each block, blocks (run, its
    middle in s), white residual (m,)."""
    PD = projector(D)
    F, g = D.T @ PD, PD.T @ white
    run, at = np.array([i for i, _ in blocks]), np.array([t for _, t in blocks])
    best = AnyHistory(0.0, np.zeros(len(at)), np.zeros(len(at)), np.zeros_like(D))
    for memory in MEMORIES:
        R = np.exp(-np.abs(at[:, None] - at) / memory) * (run[:, None] == run)
        L = np.linalg.cholesky(R)
        inner, seen = L.T @ F @ L, L.T @ g
        for sigma in SIGMAS:
            A = scipy.linalg.cho_factor(np.eye(len(R)) + sigma**2 * (inner + inner.T) / 2.0, lower=True)
            likely = sigma * scipy.linalg.cho_solve(A, sigma * seen)
            evidence = float(seen @ likely) - 2.0 * float(np.log(np.diag(A[0])).sum())
            if evidence > best.evidence:
                half = scipy.linalg.solve_triangular(A[0], sigma * L.T, lower=True)
                best = AnyHistory(evidence, L @ likely, np.sqrt((half**2).sum(axis=0)), sigma * D @ L)
    return best
