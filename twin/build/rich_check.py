"""Whether a rich basis is fine enough for the limits of the certificate, at points that it was not made from.

The output error of a Galerkin projection for one input, shift s and coefficients theta needs one factorisation of the
full body. It is taken in a case in which the warmest node of the response has the temperature range that the limits
are for, so that kelvins and micrometres of the certificate can be compared with it.
"""

from __future__ import annotations

import numpy as np

from twin.build.body_matrix import system_matrix
from twin.build.factorize import factorize
from twin.machine.description import Limits
from twin.rom.model import AffineBody
from twin.rom.tableau import SDIRK2_6

# Shifts [1/s] of the checks: of a step of a minute (the runtime's), and of three hours.
SHIFTS = (1.0 / (SDIRK2_6.diagonal * 60.0), 1e-4)

SHARE = 1 / 3  # of the limits that a rich basis may use; the rest is for the reduction and the time step


def rich_error(full: AffineBody, rich: AffineBody, low: np.ndarray, high: np.ndarray, limits: Limits) -> float:
    """Largest error of any temperature or TCP row for any input, as a share of the limit for it.

    full, rich: the same body before and after projection. low, high: (n_theta,) bounds of all coefficients
    [W/(m^2 K)]; checked are one point near the lower bounds at the fast shift, one near the upper ones at the slow.
    Temperatures are those of sensors and ports.
    """
    worst = 0.0
    for shift, place in zip(SHIFTS, (0.25, 0.75), strict=True):
        theta = low * (high / low) ** place
        exact, reduced = _responses(full, theta, shift), _responses(rich, theta, shift)
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
