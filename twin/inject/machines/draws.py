"""Draws that several parts of a drawn machine share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

T = TypeVar("T")


def one_of(rng: np.random.Generator, values: Sequence[T]) -> T:
    """One of the values, all alike in probability."""
    return values[int(rng.integers(len(values)))]


def even(rng: np.random.Generator, low: float, high: float) -> int:
    """An even whole number of low .. high [mm], so that halves of lengths are whole."""
    return 2 * int(rng.integers(int(low) // 2, int(high) // 2 + 1))


def about(rng: np.random.Generator, value: float, spread: float, digits: int = 3) -> float:
    """A value times exp(normal of standard deviation `spread`), rounded to digits that a person would write."""
    return rounded(value * float(np.exp(spread * rng.standard_normal())), digits)


def between(rng: np.random.Generator, low: float, high: float, digits: int = 3) -> float:
    """Uniform in the logarithm between two positive values, rounded."""
    return rounded(low * (high / low) ** float(rng.random()), digits)


def rounded(value: float, digits: int = 3) -> float:
    return float(f"{value:.{digits}g}")


def with_unit(value: float, unit: str) -> str:
    """ "12.5 W/(m^2*K)"."""
    return f"{value:g} {unit}"
