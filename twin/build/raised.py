"""Heights that follow the axes: what a metre of each linear axis adds to the first moments of height of a body's films.

A body that an axis moves goes up by the vertical part of the axis' direction, all of it alike. So H, which is linear in
the height, is linear in the positions, and the term of an axis is that part times M: no new affine term.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.machine.description import Machine
from twin.machine.kinematics import direction, linear_axes, moved_bodies
from twin.rom.model import AffineBody


def with_raised(machine: Machine, bodies: tuple[AffineBody, ...]) -> tuple[AffineBody, ...]:
    """The bodies with `raised` where they have an H and some axis moves them up or down.

    A platform on struts keeps the heights of its drawn pose: it goes where all of them together put it.
    """
    if machine.struts or all(body.H is None for body in bodies):
        return bodies
    vertical = "xyz".index(machine.machine.vertical)
    up = np.array([direction(machine, axis)[vertical] for axis in linear_axes(machine)])
    moved = [moved_bodies(machine, axis) for axis in linear_axes(machine)]
    found = []
    for body in bodies:
        climb = up * [body.name in names for names in moved]
        if body.H is not None and climb.any():
            body = replace(body, raised=climb[:, None, None] * body.M)
        found.append(body)
    return tuple(found)
