"""Film coefficients of moving air and of moving surfaces [W/(m^2 K)], forced and mixed with free convection.

All take the size of a speed (its sign does not matter), `surface` and `ambient` [degC] and lengths [m], and look up air
at the film temperature. A part moving through still air and a part at rest swept by air are alike if the speed is
theirs; the length of a plate is its extent along the motion. The forced laws stand for moving air alone and keep, below
Re = 10, the lower end of their range, its value: a part that also stands still wants a mixed law. Mixed laws have the
plus sign of crossing and assisting flows only: with the minus of opposing flows h would reach zero where both are of
one strength.
Each law has its `_holds` with the same arguments.
Source: papers 000 eq (7) and 004 eqs (11)-(13); the correlations replace the lost Table 3 of paper 004.
"""

from __future__ import annotations

import jax.numpy as jnp

from twin.physics import nusselt_forced as nusselt
from twin.physics import nusselt_free
from twin.physics.air import air, in_table
from twin.physics.free_convection import (
    free_flow,
    free_horizontal_cylinder,
    free_horizontal_cylinder_holds,
    free_horizontal_down,
    free_horizontal_down_holds,
    free_horizontal_up,
    free_horizontal_up_holds,
    within,
)
from twin.physics.powers import power

LEAST_REYNOLDS = 10.0


def _film(surface, ambient):
    return air(0.5 * (surface + ambient))


def reynolds(speed, surface, ambient, length):
    """Re = |v| L / nu at the film temperature; speed [m/s], temperatures [degC], length [m]."""
    return jnp.abs(speed) * length / _film(surface, ambient).viscosity


def _never_at_rest(re):
    return jnp.maximum(re, LEAST_REYNOLDS)


def _in_range(speed, surface, ambient, length, low, high):
    re = reynolds(speed, surface, ambient, length)
    return in_table(0.5 * (surface + ambient)) & (re >= low) & (re <= high)


def forced_plate(speed, surface, ambient, length):
    """h of a plate along a technical flow: Nu = sqrt(Nu_lam^2 + Nu_turb^2). Correlation G3."""
    gas = _film(surface, ambient)
    re = _never_at_rest(reynolds(speed, surface, ambient, length))
    return gas.conductivity / length * nusselt.plate(re, gas.prandtl)


def forced_plate_holds(speed, surface, ambient, length):
    """10 < Re < 1e7."""
    return _in_range(speed, surface, ambient, length, 10.0, 1e7)


def forced_cylinder(speed, surface, ambient, diameter):
    """h of a cylinder in cross flow, Churchill and Bernstein. Correlation G5."""
    gas = _film(surface, ambient)
    re = _never_at_rest(reynolds(speed, surface, ambient, diameter))
    return gas.conductivity / diameter * nusselt.cylinder(re, gas.prandtl)


def forced_cylinder_holds(speed, surface, ambient, diameter):
    """Re Pr >= 0.2 is published; what holds here is Re >= 10, below which the law keeps its value, and Re < 1e7."""
    return _in_range(speed, surface, ambient, diameter, 10.0, 1e7)


def forced_bar(speed, surface, ambient, height, constant, exponent):
    """h of a bar that is not round, in cross flow: Nu = C Re^m Pr^(1/3), height across the flow. Correlation G7.

    The constants, by default of a square face on, were not checked in the original.
    """
    gas = _film(surface, ambient)
    re = _never_at_rest(reynolds(speed, surface, ambient, height))
    return gas.conductivity / height * nusselt.bar(re, gas.prandtl, constant, exponent)


def forced_bar_holds(speed, surface, ambient, height, constant, exponent):
    """5e3 < Re < 1e5."""
    return _in_range(speed, surface, ambient, height, 5e3, 1e5)


def rotating_cylinder(speed, surface, ambient, diameter):
    """h of a shaft, screw or chuck turning in still air: Nu = 0.133 Re^(2/3) Pr^(1/3). Correlation G8.

    speed [1/s], Re = omega D^2 / nu with omega = 2 pi n. The constant was not checked in the original (Becker 1963).
    """
    gas = _film(surface, ambient)
    re = _never_at_rest(rotational_reynolds(speed, surface, ambient, diameter))
    return gas.conductivity / diameter * nusselt.rotating_cylinder(re, gas.prandtl)


def rotational_reynolds(speed, surface, ambient, diameter):
    """Re = omega D^2 / nu = 2 pi |n| D^2 / nu, n in 1/s."""
    return 2.0 * jnp.pi * jnp.abs(speed) * diameter**2 / _film(surface, ambient).viscosity


def rotating_cylinder_holds(speed, surface, ambient, diameter):
    """10 < Re_omega < 4.3e5; the lower end is where the law keeps its value."""
    re = rotational_reynolds(speed, surface, ambient, diameter)
    return in_table(0.5 * (surface + ambient)) & (re >= LEAST_REYNOLDS) & (re <= 4.3e5)


def mixed_plate(speed, surface, ambient, length, height):
    """h of a vertical plate in free and forced flow: h^3 = h_forced^3 + h_free^3. Correlation G9 of G3 and F1.

    length [m] along the motion, height [m] of the free flow. The sign is that of crossing or assisting flows: an axis
    moves to and fro, and mostly across the rising air.
    """
    ra, pr, k = free_flow(surface, ambient, height)
    forced = k / length * nusselt.plate(reynolds(speed, surface, ambient, length), pr)
    return nusselt.mixed(forced, k / height * nusselt_free.vertical_plate(ra, pr))


def mixed_plate_holds(speed, surface, ambient, length, height):
    """Re < 1e7 along the motion, 0.1 < Ra < 1e12 over the height."""
    ra = free_flow(surface, ambient, height).ra
    return within(surface, ambient, ra, 0.1, 1e12) & _in_range(speed, surface, ambient, length, 0.0, 1e7)


def mixed_plate_two_axes(speed, speed_across, surface, ambient, length, height):
    """h of a vertical plate that two axes square to each other move: mixed_plate at sqrt(v1^2 + v2^2).

    Velocities of axes are components of one vector, so the air passes at its length; which way does not matter to
    correlation G3 beyond the length along the motion. Taking the larger speed was rejected: 29 % less where both are
    equal, and a corner in between.
    """
    return mixed_plate(_together(speed, speed_across), surface, ambient, length, height)


def mixed_plate_two_axes_holds(speed, speed_across, surface, ambient, length, height):
    """As mixed_plate."""
    return mixed_plate_holds(_together(speed, speed_across), surface, ambient, length, height)


def _together(speed, speed_across):
    """sqrt(v1^2 + v2^2) with a finite derivative at rest."""
    return power(jnp.asarray(speed) ** 2 + jnp.asarray(speed_across) ** 2, 0.5)


def mixed_horizontal_up(speed, surface, ambient, length, area_over_perimeter):
    """h of a surface that faces up in free and forced flow: h^3 = h_forced^3 + h_free^3. Correlation G9 of G3 with F4
    where it is warmer than the air, F5 where it is colder.

    length [m] along the motion; area_over_perimeter [m] of the free flow, a b / (2 (a + b)) of a rectangle. The air
    flows along the surface and rises or sinks across that.
    """
    free = free_horizontal_up(surface, ambient, area_over_perimeter)
    return nusselt.mixed(_along_plate(speed, surface, ambient, length), free)


def mixed_horizontal_up_holds(speed, surface, ambient, length, area_over_perimeter):
    """Re < 1e7 along the motion, and the ranges of free_horizontal_up."""
    free = free_horizontal_up_holds(surface, ambient, area_over_perimeter)
    return free & _in_range(speed, surface, ambient, length, 0.0, 1e7)


def mixed_horizontal_down(speed, surface, ambient, length, area_over_perimeter):
    """h of a surface that faces down in free and forced flow: F5 where it is warmer than the air, F4 where it is
    colder. Otherwise as mixed_horizontal_up.
    """
    free = free_horizontal_down(surface, ambient, area_over_perimeter)
    return nusselt.mixed(_along_plate(speed, surface, ambient, length), free)


def mixed_horizontal_down_holds(speed, surface, ambient, length, area_over_perimeter):
    """Re < 1e7 along the motion, and the ranges of free_horizontal_down."""
    free = free_horizontal_down_holds(surface, ambient, area_over_perimeter)
    return free & _in_range(speed, surface, ambient, length, 0.0, 1e7)


def _along_plate(speed, surface, ambient, length):
    """G3 down to rest, where it is zero."""
    gas = _film(surface, ambient)
    return gas.conductivity / length * nusselt.plate(reynolds(speed, surface, ambient, length), gas.prandtl)


def mixed_cylinder(speed, surface, ambient, diameter):
    """h of a horizontal cylinder in free and cross flow: Nu^3 = Nu_forced^3 + Nu_free^3. Correlation G9 of G5 and F6.

    speed [m/s] across the axis, level. At rest the 0.3 of G5 remains: below 1 % of h from Nu_free = 1 on.
    """
    gas = _film(surface, ambient)
    forced = nusselt.cylinder(reynolds(speed, surface, ambient, diameter), gas.prandtl)
    return nusselt.mixed(gas.conductivity / diameter * forced, free_horizontal_cylinder(surface, ambient, diameter))


def mixed_cylinder_holds(speed, surface, ambient, diameter):
    """Re < 1e7 and Ra <= 1e12."""
    free = free_horizontal_cylinder_holds(surface, ambient, diameter)
    return free & _in_range(speed, surface, ambient, diameter, 0.0, 1e7)


def mixed_rotating_cylinder(speed, surface, ambient, diameter):
    """h of a horizontal shaft at rest or turning: Nu^3 = Nu_rotation^3 + Nu_free^3. Correlation G9 of G8 and F6.

    speed [1/s]. A ball screw or a spindle nose; ambient air is still.
    """
    ra, pr, k = free_flow(surface, ambient, diameter)
    turning = nusselt.rotating_cylinder(rotational_reynolds(speed, surface, ambient, diameter), pr)
    return k / diameter * nusselt.mixed(turning, nusselt_free.horizontal_cylinder(ra, pr))


def mixed_rotating_cylinder_holds(speed, surface, ambient, diameter):
    """Re_omega < 4.3e5 and Ra <= 1e12."""
    ra = free_flow(surface, ambient, diameter).ra
    turning = rotational_reynolds(speed, surface, ambient, diameter) <= 4.3e5
    return within(surface, ambient, ra, 0.0, 1e12) & turning
