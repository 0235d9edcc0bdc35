"""Whether a rich basis is fine enough for the limits of the certificate, at points that it was not made from.

The output error of a Galerkin projection for one input, shift s and coefficients theta needs one factorisation of the
full body. It is taken in a case in which the warmest node of the response has the temperature range that the limits
are for, so that kelvins and micrometres of the certificate can be compared with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.build.body_matrix import system_matrix
from twin.build.factorize import factorize
from twin.machine.description import Limits
from twin.rom.model import AffineBody
from twin.rom.tableau import SDIRK2_6

# Shifts [1/s] of the checks: of a step of a minute (the runtime's), and of three hours.
SHIFTS = (1.0 / (SDIRK2_6.diagonal * 60.0), 1e-4)

SHARE = 1 / 3  # of the limits that a rich basis may use; the rest is for the reduction and the time step


@dataclass(frozen=True)
class CheckPoint:
    """Where a rich basis is held against the full body, and what that has there."""

    theta: np.ndarray  # (n_theta,) W/(m^2 K)
    shift: float  # 1/s
    exact: np.ndarray  # (n, n_inputs) states of the full body


def check_points(full: AffineBody, low: np.ndarray, high: np.ndarray) -> list[CheckPoint]:
    """One point near the lower bounds of all coefficients (n_theta,) [W/(m^2 K)] at the fast shift, one near the upper
    ones at the slow."""
    made = [(low * (high / low) ** place, shift) for shift, place in zip(SHIFTS, (0.25, 0.75), strict=True)]
    return [CheckPoint(theta, shift, _responses(full, theta, shift)) for theta, shift in made]


def rich_error(full: AffineBody, rich: AffineBody, points: Sequence[CheckPoint], limits: Limits) -> float:
    """Largest error of any temperature or TCP row for any input at the points, as a share of the limit for it.

    full, rich: the same body before and after projection. Temperatures are those of sensors and ports.
    """
    worst = 0.0
    for point in points:
        exact, reduced = point.exact, _responses(rich, point.theta, point.shift)
        warmest = np.abs(exact).max(axis=0)
        acts = warmest > 0.0  # sources without a surface on this body have zero columns
        exact, reduced, scale = exact[:, acts], reduced[:, acts], limits.at_temperature_range / warmest[acts]
        outputs = (
            (limits.temperature, full.C, rich.C),
            (limits.temperature, full.port_rows, rich.port_rows),
            (limits.displacement, full.G.reshape(-1, full.n), rich.G.reshape(-1, rich.n)),
        )
        for limit, of_full, of_rich in outputs:
            error = np.abs(of_full @ exact - of_rich @ reduced) * scale
            worst = float(np.maximum(worst, error.max(initial=0.0) / limit))  # nan stays nan: no basis passes with it
    return worst


def _responses(body: AffineBody, theta: np.ndarray, shift: float) -> np.ndarray:
    """(n, n_inputs): states for 1 W of every source, 1 K outside of every film, 1 W into every port."""
    S = system_matrix(body, theta, shift)
    inputs = np.column_stack([body.B, body.M, body.P])
    if isinstance(S, np.ndarray):
        return np.asarray(np.linalg.solve(S, inputs))
    factor = factorize(S.tocsr(), rhs_hint=inputs.shape[1])
    X = factor.solve(inputs)
    factor.close()
    return np.asarray(X)
