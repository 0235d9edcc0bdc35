"""Figures of merit of a computed value beside a measured one (papers.md 1.7; formulas in docs/scores.md).

A share or a percentage says nothing where hardly anything was measured: it is None where the measured value is below
`QUOTABLE` times its uncertainty (errata E-000-6, E-002-11).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

QUOTABLE = 3.0


@dataclass(frozen=True)
class Figures:
    """Of n measurements; SI, temperatures in K. None: not defined, or not quotable."""

    n: int
    rms: float  # of the residual
    max_abs: float
    mean: float | None  # of the residual; None of vectors
    p2p: float | None  # max - min of the residual; None of vectors
    p2p_003: float | None  # |max| + |min|: paper 003 eq (4), which is more where the residual keeps one sign (E-003-4)
    fit: float | None  # %, paper 003 eq (5)
    share: float | None  # 1: share of the measured value that is computed, 1 - rms(residual)/rms(measured)
    percent_of_max: float | None  # %: max_abs of the largest measured value; of temperatures the largest rise
    measured_rms: float
    uncertainty: float  # rms of the standard deviation of the measurements


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def p2p(residual: np.ndarray) -> float:
    """max - min."""
    return float(np.max(residual) - np.min(residual))


def p2p_003(residual: np.ndarray) -> float:
    """Paper 003 eq (4): |max| + |min|. The same as `p2p` only where the residual changes sign (erratum E-003-4)."""
    return float(abs(np.max(residual)) + abs(np.min(residual)))


def fit(measured: np.ndarray, computed: np.ndarray) -> float | None:
    """Paper 003 eq (5) with erratum E-003-3 [%]: 100 perfect, 0 as good as the mean of the measured, (n,) or (n, 3).

    None where nothing but a constant was measured.
    """
    spread = float(np.linalg.norm(measured - measured.mean(axis=0)))
    if spread <= 1e-12 * float(np.linalg.norm(measured)):
        return None
    return 100.0 * (1.0 - float(np.linalg.norm(measured - computed)) / spread)


def share(measured: np.ndarray, computed: np.ndarray, uncertainty: float) -> float | None:
    """1 - rms(measured - computed)/rms(measured), (n,) or (n, 3); None where rms(measured) < 3 uncertainties (E-000-6).

    uncertainty: standard deviation of one value, or of the length of one vector.
    """
    size = rms(_lengths(measured))
    if size == 0.0 or size < QUOTABLE * uncertainty:
        return None
    return 1.0 - rms(_lengths(measured - computed)) / size


def figures(measured: np.ndarray, computed: np.ndarray, sigma: np.ndarray) -> Figures:
    """All figures of n > 0 values (n,), or of vectors (n, c); sigma (n,): standard deviation of each component.

    measured: relative to the start, where a rise is meant.
    """
    residual = measured - computed
    vector = measured.ndim == 2
    uncertainty = rms(sigma) * (np.sqrt(measured.shape[1]) if vector else 1.0)
    largest = float(_lengths(measured).max())
    told = share(measured, computed, uncertainty)
    worst = float(_lengths(residual).max())
    return Figures(
        n=len(measured),
        rms=rms(_lengths(residual)),
        max_abs=worst,
        mean=None if vector else float(residual.mean()),
        p2p=None if vector else p2p(residual),
        p2p_003=None if vector else p2p_003(residual),
        fit=fit(measured, computed),
        share=told,
        percent_of_max=None if told is None else 100.0 * worst / largest,
        measured_rms=rms(_lengths(measured)),
        uncertainty=float(uncertainty),
    )


def _lengths(values: np.ndarray) -> np.ndarray:
    return np.abs(values) if values.ndim == 1 else np.linalg.norm(values, axis=1)
