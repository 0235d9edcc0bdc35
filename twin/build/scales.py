"""Growth of encoder scales that a description lacks otherwise: `[scales.NAME]`.

A scale that takes the mean temperature T of a surface adds to the TCP displacement, tool minus work, along its axis

    -alpha (T - T_ref) (s - s_fix)

with s the position of the axis and s_fix the one at which the growth moves nothing. A scale that has grown reads too
little, so the control drives too far: with alpha > 0 this is that error where the axis carries the work; where it
carries the tool, the error has the other sign, and alpha is negative. What a compensation in the control gets wrong may
have either sign. Other than a linear encoder (`twin.build.encoder`) it needs no reader and moves no nut: it is a term
of the TCP alone, linear in position and in temperature.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.machine.description import Machine, Scale
from twin.machine.kinematics import direction, linear_axes


@dataclass(frozen=True)
class AddedScale:
    """What one `[scales.NAME]` adds to the TCP displacement."""

    axis: int  # of the linear ones
    along: np.ndarray  # (3,) unit vector of the axis
    body: int
    states: np.ndarray  # (m,) of the body: nodes of the surface
    mean: np.ndarray  # (m,) 1: the surface's mean temperature
    expansion: float  # 1/K
    fixed_at: float  # m, a position of the axis

    def rows(self, position: float) -> np.ndarray:
        """TCP displacement (3, m) [m/K] per T - T_ref of the states, at a position [m] of the axis."""
        return np.outer(-self.expansion * (position - self.fixed_at) * self.along, self.mean)


def added_scale(machine: Machine, scale: Scale, body: int, states: np.ndarray, mean: np.ndarray) -> AddedScale:
    """A scale on states (m,) of a body whose weights `mean` (m,) give its temperature."""
    return AddedScale(
        axis=linear_axes(machine).index(scale.axis),
        along=direction(machine, scale.axis),
        body=body,
        states=states,
        mean=mean,
        expansion=scale.expansion,
        fixed_at=scale.fixed_at,
    )
