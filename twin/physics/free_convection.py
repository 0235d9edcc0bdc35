"""Film coefficients of free convection in air [W/(m^2 K)], by surface and air temperature.

All take `surface` and `ambient` [degC] and lengths [m], and look up air at the film temperature (surface + ambient)/2.
Which way a surface faces is said by choosing the law; whether it is the warm or the cold side follows from the
temperatures. Without a difference of temperature there is still a coefficient, that of 0.01 K: it multiplies a heat
of zero, and spares the solvers a division. Each law has its `_holds` with the same arguments. Below 0.5 K no lower
limit of a range is flagged, as hardly any heat flows.
Source: papers 000 eq (7) and 004 eqs (11)-(13); the correlations replace the lost Table 2 of paper 004.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax.numpy as jnp

from twin.physics import nusselt_free as nusselt
from twin.physics.air import GRAVITY, air, in_table
from twin.physics.powers import magnitude

LEAST_DIFFERENCE = 0.01  # K
OF_ACCOUNT = 0.5  # K


class FreeFlow(NamedTuple):
    """Air beside a surface."""

    ra: Any
    pr: Any
    conductivity: Any  # W/(m K)


def free_flow(surface, ambient, length) -> FreeFlow:
    """Ra = g beta |Ts - Tair| L^3 / (nu a) with beta = 1/Tfilm [K]."""
    gas = air(0.5 * (surface + ambient))
    difference = magnitude(surface - ambient, LEAST_DIFFERENCE)
    ra = GRAVITY * gas.expansion * difference * length**3 / (gas.viscosity * gas.diffusivity)
    return FreeFlow(ra, gas.prandtl, gas.conductivity)


def within(surface, ambient, value, low, high):
    """Whether the film is in the table of air and `value` in its range, `low` where heat of any account flows."""
    enough = (value >= low) | (jnp.abs(surface - ambient) < OF_ACCOUNT)
    return in_table(0.5 * (surface + ambient)) & enough & (value <= high)


def free_vertical_plate(surface, ambient, height):
    """h of a vertical plate: Nu = (0.825 + 0.387 (Ra f1)^(1/6))^2 with the height as length. Correlation F1."""
    ra, pr, k = free_flow(surface, ambient, height)
    return k / height * nusselt.vertical_plate(ra, pr)


def free_vertical_plate_holds(surface, ambient, height):
    """0.1 < Ra < 1e12."""
    return within(surface, ambient, free_flow(surface, ambient, height).ra, 0.1, 1e12)


def free_vertical_plate_laminar(surface, ambient, height):
    """h of a vertical plate in laminar flow only: Nu = 0.68 + 0.670 Ra^(1/4) / [1 + (0.492/Pr)^(9/16)]^(4/9). F1l."""
    ra, pr, k = free_flow(surface, ambient, height)
    return k / height * nusselt.vertical_plate_laminar(ra, pr)


def free_vertical_plate_laminar_holds(surface, ambient, height):
    """Ra <= 1e9."""
    return within(surface, ambient, free_flow(surface, ambient, height).ra, 0.0, 1e9)


def _unstable(surface, ambient, angle):
    """Whether the heavier air lies above: a hot surface facing up (angle > 0), or a cold one facing down."""
    return (surface - ambient) * angle > 0.0


def free_inclined_plate(surface, ambient, length, angle):
    """h of an inclined plate: F2 on the stable side, F3 beyond the transition on the unstable side.

    angle [rad] from the vertical, positive where the surface faces up, -60 to 60 degrees; length along the slope.
    The published F2 and F3 do not meet at the transition: h jumps there by 8 to 18 %.
    """
    ra, pr, k = free_flow(surface, ambient, length)
    stable = nusselt.inclined_plate_stable(ra, pr, angle)
    unstable = nusselt.inclined_plate_unstable(ra, pr, angle)
    return k / length * jnp.where(_unstable(surface, ambient, angle), unstable, stable)


def free_inclined_plate_holds(surface, ambient, length, angle):
    """|angle| <= 60 degrees; F2 only in laminar flow, Ra cos(angle) <= 1e9; F3 to 1e12."""
    x = free_flow(surface, ambient, length).ra * jnp.cos(angle)
    most = jnp.where(_unstable(surface, ambient, angle), 1e12, 1e9)
    return within(surface, ambient, x, 0.1, most) & (jnp.abs(angle) <= jnp.deg2rad(60.0) * (1 + 1e-12))


def _hot_up(surface, ambient, length):
    ra, pr, k = free_flow(surface, ambient, length)
    return k / length * nusselt.horizontal_up(ra, pr)


def _hot_down(surface, ambient, length):
    ra, pr, k = free_flow(surface, ambient, length)
    return k / length * nusselt.horizontal_down(ra, pr)


def free_horizontal_up(surface, ambient, length):
    """h of a surface that faces up: F4 where it is warmer than the air, F5 where it is colder.

    length = area over perimeter, a b / (2 (a + b)) of a rectangle. Source: VDI-Waermeatlas F2.
    """
    return jnp.where(surface >= ambient, _hot_up(surface, ambient, length), _hot_down(surface, ambient, length))


def free_horizontal_up_holds(surface, ambient, length):
    """F4 to Ra f2 = 1e12 (no lower limit is published); F5 for 1e3 < Ra f1 < 1e10."""
    return jnp.where(surface >= ambient, _up_holds(surface, ambient, length), _down_holds(surface, ambient, length))


def free_horizontal_down(surface, ambient, length):
    """h of a surface that faces down: F5 where it is warmer than the air, F4 where it is colder.

    length = area over perimeter. Source: VDI-Waermeatlas F2.
    """
    return jnp.where(surface >= ambient, _hot_down(surface, ambient, length), _hot_up(surface, ambient, length))


def free_horizontal_down_holds(surface, ambient, length):
    """As free_horizontal_up_holds, the sides exchanged."""
    return jnp.where(surface >= ambient, _down_holds(surface, ambient, length), _up_holds(surface, ambient, length))


def _up_holds(surface, ambient, length):
    ra, pr, _ = free_flow(surface, ambient, length)
    return within(surface, ambient, ra * nusselt.f2(pr), 0.0, 1e12)


def _down_holds(surface, ambient, length):
    ra, pr, _ = free_flow(surface, ambient, length)
    return within(surface, ambient, ra * nusselt.f1(pr), 1e3, 1e10)


def free_horizontal_up_incropera(surface, ambient, length):
    """As free_horizontal_up with Incropera's F4i and F5i (7th edition), 35 to 55 % higher: the spread of literature."""
    ra, pr, k = free_flow(surface, ambient, length)
    up, down = nusselt.horizontal_up_incropera(ra, pr), nusselt.horizontal_down_incropera(ra, pr)
    return k / length * jnp.where(surface >= ambient, up, down)


def free_horizontal_up_incropera_holds(surface, ambient, length):
    """F4i for 1e4 <= Ra <= 1e11, F5i for 1e4 <= Ra <= 1e9."""
    ra = free_flow(surface, ambient, length).ra
    return within(surface, ambient, ra, 1e4, jnp.where(surface >= ambient, 1e11, 1e9))


def free_horizontal_down_incropera(surface, ambient, length):
    """As free_horizontal_down with Incropera's F5i (7th edition) and F4i."""
    return free_horizontal_up_incropera(ambient, surface, length)  # the film and |difference| are the same


def free_horizontal_down_incropera_holds(surface, ambient, length):
    """F5i for 1e4 <= Ra <= 1e9, F4i for 1e4 <= Ra <= 1e11."""
    ra = free_flow(surface, ambient, length).ra
    return within(surface, ambient, ra, 1e4, jnp.where(surface >= ambient, 1e9, 1e11))


def free_horizontal_cylinder(surface, ambient, diameter):
    """h of a horizontal cylinder: Nu = (0.60 + 0.387 (Ra f3)^(1/6))^2 with the diameter as length. Correlation F6."""
    ra, pr, k = free_flow(surface, ambient, diameter)
    return k / diameter * nusselt.horizontal_cylinder(ra, pr)


def free_horizontal_cylinder_holds(surface, ambient, diameter):
    """Ra <= 1e12."""
    return within(surface, ambient, free_flow(surface, ambient, diameter).ra, 0.0, 1e12)


def free_vertical_cylinder(surface, ambient, diameter, height):
    """h of the side of a vertical cylinder: a vertical plate, more where it is slender (Popiel). Correlation F7."""
    ra, pr, k = free_flow(surface, ambient, height)
    return k / height * nusselt.vertical_cylinder(ra, pr, height / diameter)


def free_vertical_cylinder_holds(surface, ambient, diameter, height):
    """0.1 < Ra < 1e12 over the height."""
    return free_vertical_plate_holds(surface, ambient, height)


def free_box(surface, ambient, length, width, height):
    """Mean h of a closed box in free air, by area: four sides F1, one horizontal face F4 and one F5.

    Warm or cold, one of its horizontal faces works as hot-up and the other as hot-down. Both count: take
    free_vertical_plate and the like for the faces of a box that stands on something.
    """
    sides, face = 2.0 * (length + width) * height, length * width
    across = face / (2.0 * (length + width))
    horizontal = _hot_up(surface, ambient, across) + _hot_down(surface, ambient, across)
    return (sides * free_vertical_plate(surface, ambient, height) + face * horizontal) / (sides + 2.0 * face)


def free_box_holds(surface, ambient, length, width, height):
    """Each of its three correlations."""
    across = length * width / (2.0 * (length + width))
    horizontal = _up_holds(surface, ambient, across) & _down_holds(surface, ambient, across)
    return free_vertical_plate_holds(surface, ambient, height) & horizontal
