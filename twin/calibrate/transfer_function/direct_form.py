"""The direct form of eq (3) of paper 003, with erratum E-003-2, only to be read, never to be kept (erratum E-003-6).

y(k) = [Σ_{i=0..n} a_i u(k-i) - Σ_{j=1..n} b_j y(k-j)] / b_0

Thermal poles are close to 1 against the sampling interval, so that Σ b_j is a small difference of large numbers, and
with it the DC gain Σ a_i / Σ b_j. With the coefficients of the paper's Table 2, half a unit of the last printed digit
of b_2 moves it from -16.5 to -7.3 um/K or makes the model unstable.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from twin.calibrate.transfer_function.model import TransferFunction
from twin.errors import ModelError

FLOAT32 = 2.0**-24  # relative rounding error
WORTH_A_WARNING = 0.01  # of the DC gain
SEPARATE = 1e-9  # poles nearer than this are one to double precision


class ConditioningWarning(UserWarning):
    """The coefficients, as they are rounded, do not determine the model."""


@dataclass(frozen=True)
class Conditioning:
    """What rounding of the coefficients does to the DC gain of the first input."""

    dc_gain: float
    amplification: float  # relative error of the DC gain per relative error of the coefficients b
    dc_gain_range: tuple[float, float]  # when every b_j is off by half a unit of its last digit: least and most
    may_be_unstable: bool


def from_direct_form(a: np.ndarray, b: np.ndarray, dt: float, half_digit: float | np.ndarray = 0.0) -> TransferFunction:
    """Poles and residues of numerators a (n_a,) or (m, n_a) and a denominator b (n_b,), n_a <= n_b, every dt [s].

    The coefficients are taken as exact. half_digit: half a unit of the last digit of b_1, b_2, ... as printed (one
    number, or one each). A ConditioningWarning tells where that, or single precision, leaves the DC gain open.

    Raises ModelError where the model is unstable, or poles coincide (no residues), or n_a > n_b.
    """
    a = np.atleast_2d(np.asarray(a, dtype=float))
    b = np.asarray(b, dtype=float)
    if b.ndim != 1 or not len(b) or b[0] == 0.0 or a.shape[1] > len(b):
        raise ModelError(
            f"numerator of {a.shape[1]} and denominator of {b.size} coefficients", "", "b_0 is not zero, n_a <= n_b"
        )
    a = np.hstack([a, np.zeros((len(a), len(b) - a.shape[1]))]) / b[0]
    found = conditioning(a[0], b / b[0], np.asarray(half_digit) / abs(b[0]))
    told = f"the DC gain {found.dc_gain:.6g} depends on differences of large numbers ({found.amplification:.1e} times)"
    moved = found.amplification * FLOAT32 > WORTH_A_WARNING
    if np.any(half_digit):
        near, far = found.dc_gain_range
        told += f"; with the last printed digits it lies between {near:.4g} and {far:.4g}"
        told += ", and the model may be unstable" if found.may_be_unstable else ""
        moved = found.may_be_unstable or abs(far - near) > WORTH_A_WARNING * abs(found.dc_gain)
    else:
        told += ": keep poles and residues, never these coefficients in single precision"
    if moved:
        warnings.warn(told, ConditioningWarning, stacklevel=2)
    b = b / b[0]
    poles = np.roots(b)  # fewer than n where the last coefficients are zero: then poles at zero remain
    poles = np.concatenate([poles, np.zeros(len(b) - 1 - len(poles))]).astype(complex)
    kept = poles[poles.imag >= 0.0]
    apart = np.abs(poles[:, None] - poles[None, :]) + np.diag(np.full(len(poles), np.inf))
    if len(poles) > 1 and apart.min() < SEPARATE:
        raise ModelError(f"poles coincide at {poles[np.argmin(apart.min(axis=0))]:.6g}", "", "lower the order")
    direct = a[:, 0]
    slope = np.polyval(np.polyder(b), kept)
    residues = np.stack([np.polyval(row - d * b, kept) / slope for row, d in zip(a, direct, strict=True)], axis=1)
    real = kept.imag == 0.0
    residues[real] = residues[real].real
    return TransferFunction(dt, kept, residues, direct)


def conditioning(a: np.ndarray, b: np.ndarray, half_digit: float | np.ndarray = 0.0) -> Conditioning:
    """How the DC gain of numerator a (n,) and denominator b (n,), b_0 = 1, depends on rounding; see `Conditioning`."""
    top, total = float(a.sum()), float(b.sum())
    if total == 0.0:
        return Conditioning(np.inf, np.inf, (-np.inf, np.inf), True)
    spread = float(np.broadcast_to(half_digit, len(b) - 1).sum())
    unstable = spread >= abs(total)  # a pole crosses 1 where Σ b_j does zero
    near = top / (total + np.copysign(spread, total))
    far = float(np.copysign(np.inf, top / total)) if unstable else top / (total - np.copysign(spread, total))
    return Conditioning(top / total, float(np.abs(b[1:]).sum()) / abs(total), (float(near), far), unstable)
