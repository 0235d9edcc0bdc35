"""Friction heat of rolling bearings [W]. Arguments are numbers or arrays in SI units."""

from __future__ import annotations

import jax.numpy as jnp

from twin.physics.radiation import ZERO_CELSIUS

SWITCH = 2000.0  # nu n [mm^2/s 1/min] below which the lubricant's torque no longer depends on speed


def bearing_friction(speed, f0, viscosity, diameter, f1, load):
    """Loss of a rolling bearing: P = 2 pi n (M0 + M1), M0 by Palmgren, M1 = f1 P1 d_m.

    With nu in mm^2/s, n in 1/min and d_m in mm: M0 = 1e-7 f0 (nu n)^(2/3) d_m^3 N mm for nu n >= 2000,
    else 160e-7 f0 d_m^3 N mm. speed [1/s], f0 [1], viscosity [m^2/s], diameter d_m [m], f1 [1], load P1 [N].
    Source: paper 002 eqs (4)-(6), ISO 15312, with errata E-002-1 (printed 1e-3 pi n M, half of the power),
    E-002-4 (printed without the form for low speeds) and E-002-5 (printed with 2 % of the static axial load, which is
    a reference condition of ISO 15312 for thrust roller bearings, 5 % of C0 for radial ones, and no operating load:
    give the real one).
    """
    n = jnp.abs(speed)
    d = diameter * 1e3  # mm
    nu_n = viscosity * 1e6 * n * 60.0
    viscous = jnp.where(nu_n >= SWITCH, 1e-7 * jnp.maximum(nu_n, SWITCH) ** (2.0 / 3.0), 160e-7)
    torque = f0 * viscous * d**3 * 1e-3 + f1 * load * diameter  # N m
    return 2.0 * jnp.pi * n * torque


def oil_viscosity(temperature, viscosity_40, viscosity_100):
    """Kinematic viscosity [m^2/s] of a mineral oil at a temperature [degC] from those at 40 and 100 degC.

    log10 log10 (nu + 0.7) = A - B log10 T, nu in mm^2/s, T in K; held below -40 and above 200 degC.
    Source: Ubbelohde and Walther, ASTM D341.
    """

    def double_log(viscosity):
        return jnp.log10(jnp.log10(viscosity * 1e6 + 0.7))

    at_40, at_100 = jnp.log10(40.0 + ZERO_CELSIUS), jnp.log10(100.0 + ZERO_CELSIUS)
    low, high = double_log(viscosity_40), double_log(viscosity_100)
    t = jnp.log10(jnp.clip(temperature, -40.0, 200.0) + ZERO_CELSIUS)
    return (10.0 ** (10.0 ** (low + (high - low) * (t - at_40) / (at_100 - at_40))) - 0.7) * 1e-6


def bearing_friction_warm(speed, temperature, f0, viscosity_40, viscosity_100, diameter, f1, load):
    """bearing_friction with the oil's viscosity at the bearing's temperature [degC]: a bearing that warms runs easier.

    viscosity_40, viscosity_100 [m^2/s] of the (base) oil. Source: paper 002 eqs (4)-(6); erratum E-002-5 (real nu(T));
    viscosity by Ubbelohde and Walther.
    """
    return bearing_friction(speed, f0, oil_viscosity(temperature, viscosity_40, viscosity_100), diameter, f1, load)


def bearing_friction_warm_holds(speed, temperature, f0, viscosity_40, viscosity_100, diameter, f1, load):
    """-20 to 150 degC, and an oil that thins as it warms."""
    return (temperature >= -20.0) & (temperature <= 150.0) & (viscosity_100 < viscosity_40)
