"""Which transfer function: inputs and order by the best fit on a held-out part of the training data (paper 003)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from twin.calibrate.transfer_function.arx import fit_arx
from twin.calibrate.transfer_function.model import TransferFunction, first_order_lags, pieces
from twin.calibrate.transfer_function.output_error import fit_oe
from twin.errors import ModelError

Method = Literal["arx", "oe"]
HELD_OUT = 0.3  # of the only test: its end


@dataclass(frozen=True)
class Identified:
    """The chosen model, fitted to all training data."""

    model: TransferFunction
    method: Method
    inputs: tuple[int, ...]  # columns of u it reads
    order: int
    held_out_rms: float  # over all held-out values, in units of y

    def __call__(self, u: np.ndarray, starts: Sequence[int] = (0,)) -> np.ndarray:
        """(n,) for all inputs u (n, m); at rest at every start."""
        return self.model.simulate(u[:, list(self.inputs)], starts)


def identify(
    u: np.ndarray,
    y: np.ndarray,
    dt: float,
    method: Method = "oe",
    orders: Sequence[int] = (1, 2, 3),
    most_inputs: int = 3,
    starts: Sequence[int] = (0,),
) -> Identified:
    """The transfer function from some of the inputs u (n, m) to y (n,), sampled every dt [s]; NaN in y: not measured.

    starts: first rows of tests, at rest there. Inputs are added one by one (`rank_inputs`) up to `most_inputs`. Each
    order and number of inputs is fitted without a part of the data and judged on that part: every test in turn, or the
    end of the only one. The best one is then fitted to all.

    Raises ModelError where not even one input and the lowest order can be fitted.
    """
    u = np.asarray(u, dtype=float)
    u = u[:, None] if u.ndim == 1 else u
    ranked = rank_inputs(u, y, dt, most_inputs, starts)
    best: tuple[float, tuple[int, ...], int] | None = None
    reason: ModelError | None = None
    for count in range(1, len(ranked) + 1):
        inputs = ranked[:count]
        for order in orders:
            try:
                error = _held_out_rms(u[:, list(inputs)], y, dt, method, order, starts)
            except ModelError as e:
                reason = reason or e
                continue
            if best is None or error < best[0]:
                best = (error, inputs, order)
    if best is None:
        raise reason or ModelError("inputs that never change", "", "choose inputs that follow the loads")
    error, inputs, order = best
    model = _fit(u[:, list(inputs)], y, dt, method, order, starts)
    return Identified(model, method, inputs, order, error)


def rank_inputs(u: np.ndarray, y: np.ndarray, dt: float, most: int, starts: Sequence[int] = (0,)) -> tuple[int, ...]:
    """Up to `most` columns of u (n, m), each the one that explains y best beside those before, through lags of a few
    time constants."""
    measured = np.isfinite(y)
    longest = dt * max(b - a for a, b in pieces(starts, len(u)))
    lags = [first_order_lags(np.array([tau]), np.ones(1), dt) for tau in np.geomspace(2.0 * dt, longest, 4)]
    columns = [np.column_stack([lag.simulate(c, starts)[measured] for lag in lags]) for c in u.T]
    target = y[measured]
    chosen: list[int] = []
    varying = [i for i, c in enumerate(u.T) if np.ptp(c) > 0.0]
    while len(chosen) < min(most, len(varying)):
        residuals = {}
        for i in varying:
            if i not in chosen:
                x = np.hstack([columns[j] for j in (*chosen, i)])
                x = x / np.maximum(np.linalg.norm(x, axis=0), 1e-300)
                residuals[i] = float(np.sum((target - x @ np.linalg.lstsq(x, target, rcond=1e-8)[0]) ** 2))
        chosen.append(min(residuals, key=lambda i: residuals[i]))
    return tuple(chosen)


def _fit(
    u: np.ndarray, y: np.ndarray, dt: float, method: Method, order: int, starts: Sequence[int]
) -> TransferFunction:
    return fit_arx(u, y, dt, order, 0, starts) if method == "arx" else fit_oe(u, y, dt, order, starts=starts)


def _held_out_rms(u: np.ndarray, y: np.ndarray, dt: float, method: Method, order: int, starts: Sequence[int]) -> float:
    """rms over held-out values of models that did not see them."""
    tests = pieces(starts, len(u))
    measured = np.isfinite(y)
    if len(tests) == 1:
        rows = np.flatnonzero(measured)
        cut = rows[int((1.0 - HELD_OUT) * len(rows))] if len(rows) else 0
        held_out = [np.arange(len(u)) >= cut]
    else:
        held_out = [(np.arange(len(u)) >= a) & (np.arange(len(u)) < b) for a, b in tests]
    squares, n = 0.0, 0
    for out in held_out:
        if not (out & measured).any():
            continue
        model = _fit(u, np.where(out, np.nan, y), dt, method, order, starts)
        residual = (y - model.simulate(u, starts))[out & measured]
        squares, n = squares + float(residual @ residual), n + len(residual)
    if n == 0:
        raise ModelError("nothing measured to identify a transfer function from", "", "give longer runs")
    return float(np.sqrt(squares / n))
