"""Snapshots for the compression of a body whose inputs are all alike unknown: responses over frequency and films.

Scenarios of loads stand for what a machine meets; of bare matrices nobody knows what they will meet, so every input
counts by itself, at its range, over all frequencies, and all decades alike: it is the largest error over them that
counts. A root of the controllability Gramian, whose snapshots have the root of the frequency as a further weight, is
for errors squared and summed over time: with it `galerkin` has four times the error (`benchmarks steel_profile`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.build.body_matrix import system_matrix
from twin.rom.model import AffineBody

FREQUENCIES = np.logspace(-6, 2, 20)  # rad/s: from days to a hundredth of a second


def drawn_films(low: np.ndarray, high: np.ndarray, count: int, seed: int) -> list[np.ndarray]:
    """Film coefficients (n_theta,) log-uniform between the bounds."""
    rng = np.random.default_rng(seed)
    return [low * (high / low) ** rng.random(len(low)) for _ in range(count)]


def responses(body: AffineBody, thetas: Sequence[np.ndarray], heat: float = 0.0) -> np.ndarray:
    """Snapshots (n, m) of the states of a dense symmetric body with E = 1.

    For 1 K outside of every film and, where `heat` is above zero, for so many watts of every source.
    """
    columns = []
    for theta in thetas:
        rate, U = np.linalg.eigh(system_matrix(body, theta, 0.0))
        B = U.T @ np.column_stack([body.M * theta[list(body.theta)], heat * body.B])
        for w in FREQUENCIES:
            Z = U @ (B / (rate + 1j * w)[:, None])
            columns += [Z.real, Z.imag]
    return np.column_stack(columns)
