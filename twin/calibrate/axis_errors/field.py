"""How much of a volumetric error the single axis errors explain.

Links the thermal model, which gives a displacement at every pose, to the errors of ISO 230-1, which are what a control
can compensate and an acceptance report lists. What is left bends within an axis' range more than a parabola, or depends
on two axes at once otherwise than a rotation does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.calibrate.axis_errors.chain import Chain
from twin.calibrate.axis_errors.errors import Ranges, rigid_motion
from twin.calibrate.axis_errors.fit import AxisErrorFit, fit_axis_errors


@dataclass(frozen=True)
class FieldShares:
    """Shares of the sum of squares of a displacement field; they sum to 1. NaN each where the field is zero."""

    shift: float  # the same vector everywhere
    tilt: float  # what a rotation of the whole adds
    axis_errors: float  # what the errors of the linear axes add
    rest: float
    largest: float  # m, of the displacements
    largest_rest: float  # m, of what shift and axis errors leave
    fit: AxisErrorFit


def field_shares(chain: Chain, position: np.ndarray, tcp: np.ndarray) -> FieldShares:
    """Shares of TCP displacements (n, 3) [m] at positions (n, n_linear) [m] in the order of `chain.linear`.

    The shift is fitted first, then shift and tilt, then both and the errors: nested spaces, so sums of squares add up.
    Ranges are those of the positions. Raises LogError where there are too few positions.
    """
    ranges = Ranges.of(chain, position)
    fit = fit_axis_errors(chain, ranges, position, tcp)
    total, rest = float(np.sum(tcp**2)), float(np.sum(fit.residual**2))
    largest = float(np.linalg.norm(tcp, axis=1).max())
    largest_rest = float(np.linalg.norm(fit.residual, axis=1).max())
    if total == 0.0:
        return FieldShares(np.nan, np.nan, np.nan, np.nan, 0.0, 0.0, fit)
    shift = len(tcp) * float(np.sum(tcp.mean(axis=0) ** 2))
    N = rigid_motion(chain, ranges, position).reshape(-1, 6)
    rigid = total - float(np.sum((tcp.ravel() - N @ np.linalg.lstsq(N, tcp.ravel(), rcond=None)[0]) ** 2))
    return FieldShares(
        shift=shift / total,
        tilt=(rigid - shift) / total,
        axis_errors=(total - rigid - rest) / total,
        rest=rest / total,
        largest=largest,
        largest_rest=largest_rest,
        fit=fit,
    )
