"""Transfer functions by ARX: linear least squares of the equation error (paper 003, identification).

y(k) + Σ_{j=1..n} b_j y(k-j) = Σ_m Σ_{i=0..n} a_mi u_m(k-i) + e(k)

One linear solve, but the noise of y is among the regressors: with white noise on the output, poles come out too fast,
the more so the shorter the sampling interval against the time constants.
`twin.calibrate.transfer_function.output_error` has no such bias; ARX is here as the baseline that it is.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from twin.calibrate.transfer_function.direct_form import ConditioningWarning, from_direct_form
from twin.calibrate.transfer_function.model import TransferFunction, pieces
from twin.errors import ModelError


def fit_arx(
    u: np.ndarray, y: np.ndarray, dt: float, order: int = 2, delay: int = 0, starts: Sequence[int] = (0,)
) -> TransferFunction:
    """Transfer function of `order` poles from inputs u (n, m) or (n,) to y (n,), sampled every dt [s].

    Numerators a_mi for i = delay .. order; delay 1: no direct effect of u(k) on y(k). NaN in y: not measured; equations
    with such a value are left out, so y must be measured at most samples. starts: first rows of tests, at rest there.
    y and u are deviations from that rest.

    Raises ModelError: fewer equations than coefficients, or an unstable result.
    """
    u = np.asarray(u, dtype=float)
    u = u[:, None] if u.ndim == 1 else u
    if order < 1 or not 0 <= delay <= order:
        raise ModelError(f"order {order} and delay {delay}", "", "an order of 1 or more, a delay of 0 to the order")
    regressors, targets = [], []
    for begin, end in pieces(starts, len(u)):
        before = np.zeros(order)  # at rest: all is zero before a test
        past = [_shifted(y[begin:end], j, before) for j in range(1, order + 1)]
        inputs = [_shifted(column, i, before) for column in u[begin:end].T for i in range(delay, order + 1)]
        regressors.append(np.column_stack([*(-p for p in past), *inputs]))
        targets.append(y[begin:end])
    x, target = np.concatenate(regressors), np.concatenate(targets)
    known = np.isfinite(x).all(axis=1) & np.isfinite(target)
    if known.sum() < 2 * x.shape[1]:
        what = f"{known.sum()} equations for {x.shape[1]} coefficients"
        raise ModelError(what, "", "lower the order, use fewer inputs, or measure longer")
    coefficients = np.linalg.lstsq(x[known], target[known], rcond=None)[0]
    b = np.concatenate([[1.0], coefficients[:order]])
    a = np.zeros((u.shape[1], order + 1))
    a[:, delay:] = coefficients[order:].reshape(u.shape[1], -1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConditioningWarning)  # the coefficients are at hand in double precision
        return from_direct_form(a, b, dt)


def _shifted(values: np.ndarray, by: int, before: np.ndarray) -> np.ndarray:
    """values(k - by) (n,), with `before` ahead of the first."""
    return np.concatenate([before, values])[len(before) - by : len(before) - by + len(values)]
