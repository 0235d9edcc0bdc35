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

import numpy as np

from twin.machine.description import Machine, Scale
from twin.machine.kinematics import direction, linear_axes
from twin.rom.scales import AddedScale


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
