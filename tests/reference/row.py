"""Judging a case, and the line of docs/references.md that it stands for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

LIMIT = 1e-3  # of the range, of both models: what issue and page promise


@dataclass(frozen=True)
class Case:
    name: str
    source: str  # author, title, section or equation
    quantity: str
    unit: str = "degC"


def judge(
    case: Case, exact: np.ndarray, full: np.ndarray, reduced: np.ndarray, span: float | None = None
) -> tuple[float, float]:
    """Print the case's line and hold both models to LIMIT of the range everywhere; the errors as shares of it.

    exact, full, reduced: the same numbers (n, ...) of all compared outputs, of which the last is shown. span: the
    range; by default that of the exact numbers.
    """
    span = float(np.ptp(exact)) if span is None else span
    errors = [float(np.abs(np.asarray(m) - exact).max()) / span for m in (full, reduced)]
    shown = [f"{np.ravel(v)[-1]:.5g} {case.unit}" for v in (exact, full, reduced)]
    print(
        f"| {case.name} | {case.source} | {case.quantity} | {shown[0]} | {shown[1]}, {100 * errors[0]:.3f} % "
        f"| {shown[2]}, {100 * errors[1]:.3f} % |"
    )
    assert max(errors) <= LIMIT
    return errors[0], errors[1]
