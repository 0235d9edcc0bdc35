"""How sure a difference of two rms is: moving-block bootstrap (Künsch 1989).

Residuals of neighbours in time are alike, so single rows must not be drawn as if they were independent: blocks of
consecutive rows are, within each test, long enough for the residuals to forget each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

FEWEST_BLOCKS = 4
DRAWS = 2000
FORGOTTEN = 0.2  # autocorrelation


@dataclass(frozen=True)
class Difference:
    """rms of a model minus rms of a baseline over the same rows; below zero: the model is better."""

    value: float
    low: float | None  # 95 % interval; None where there are too few blocks to tell
    high: float | None
    block: int  # rows
    rows: int


def rms_difference(
    model: Sequence[np.ndarray], baseline: Sequence[np.ndarray], block: int | None = None, seed: int = 0
) -> Difference:
    """From the lengths of the residuals, (n_i,) for each test, of a model and of a baseline.

    block: rows; by default the first lag at which the difference of squares is correlated by less than 0.2 within the
    tests, at least the cube root of the number of rows. Blocks do not cross from test to test. Percentiles of 2000
    draws; None below FEWEST_BLOCKS blocks.
    """
    squares = [np.stack([a**2, b**2], axis=1) for a, b in zip(model, baseline, strict=True) if len(a)]
    rows = sum(len(s) for s in squares)
    total = np.concatenate(squares).mean(axis=0)
    value = float(np.sqrt(total[0]) - np.sqrt(total[1]))
    length = block if block is not None else max(_memory(squares), round(rows ** (1.0 / 3.0)), 1)
    if rows < FEWEST_BLOCKS * length:
        return Difference(value, None, None, length, rows)
    rng = np.random.default_rng(seed)
    sums = np.zeros((DRAWS, 2))
    for s in squares:
        size = min(length, len(s))
        running = np.concatenate([np.zeros((1, 2)), np.cumsum(np.concatenate([s, s[: size - 1]]), axis=0)])
        blocks = running[size : size + len(s)] - running[: len(s)]  # circular: every row is drawn equally often
        count = len(s) / size
        whole = int(count)  # rounded down: rather too wide than too narrow
        drawn = blocks[rng.integers(len(s), size=(DRAWS, whole))]
        sums += drawn.sum(axis=1) * (count / whole)
    means = np.sqrt(sums / rows)
    low, high = np.percentile(means[:, 0] - means[:, 1], [2.5, 97.5])
    return Difference(value, float(low), float(high), length, rows)


def _memory(squares: Sequence[np.ndarray]) -> int:
    """First lag [rows] at which the difference of squares is forgotten; the longest test's length where it never is."""
    differences = [s[:, 0] - s[:, 1] for s in squares]
    mean = np.concatenate(differences).mean()
    centred = [d - mean for d in differences]
    power = sum(float(c @ c) for c in centred)
    longest = max(len(c) for c in centred)
    if power == 0.0:
        return 1
    for lag in range(1, longest):
        if sum(float(c[lag:] @ c[: len(c) - lag]) for c in centred if len(c) > lag) < FORGOTTEN * power:
            return lag
    return longest
