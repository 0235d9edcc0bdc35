"""Heat of motors, guides, screws and bearings [W]. Arguments are arrays or numbers in SI units."""

from __future__ import annotations

import jax.numpy as jnp


def motor_copper(current, resistance):
    """Copper loss of a three-phase motor: P = 3 R I^2.

    current [A] rms phase current, resistance [ohm] of one phase (not line to line, which would double the heat).
    Holds at standstill: a vertical axis heats at rest (paper 000, section 4).
    Source: paper 000 eq (8) with erratum E-000-4 (rms, phase resistance).
    """
    return 3.0 * resistance * current**2


def motor_holding(current, speed, resistance, drag):
    """Copper loss plus a speed-proportional loss: P = 3 R I^2 + F |v|.

    drag F [N] collects iron and bearing losses per unit axis speed. Source: paper 000 eq (8), erratum E-000-4.
    """
    return motor_copper(current, resistance) + drag * jnp.abs(speed)


def guide_friction(speed, friction, load, seal_drag):
    """Q_f = (mu F_m + f_d) |v|. Source: paper 004 eq (6); mu = 0.001 .. 0.002 for ball guides.

    speed [m/s], friction [1], load F_m [N], seal_drag f_d [N].
    """
    return (friction * load + seal_drag) * jnp.abs(speed)


def screw_friction(speed, force, preload, diameter, lead, friction):
    """Loss of a driven ball screw with preloaded nut: P = 2 pi n (M_d + M_pl).

    n = |v|/L; eta = tan(phi)/tan(phi + rho), tan(phi) = L/(pi d), tan(rho) = mu;
    M_d = F L (1 - eta)/(2 pi eta), M_pl = F_p L (1 - eta^2)/(2 pi eta).
    Source: paper 002 eqs (7)-(10) with errata E-002-2 (2 pi, not pi) and E-002-7 (1/eta of the driven case).
    speed [m/s], force F [N], preload F_p [N], diameter d [m], lead L [m], friction mu [1].
    """
    phi = jnp.arctan(lead / (jnp.pi * diameter))
    eta = jnp.tan(phi) / jnp.tan(phi + jnp.arctan(friction))
    m_load = jnp.abs(force) * lead * (1.0 - eta) / (2.0 * jnp.pi * eta)
    m_preload = preload * lead * (1.0 - eta**2) / (2.0 * jnp.pi * eta)
    return 2.0 * jnp.pi * jnp.abs(speed) / lead * (m_load + m_preload)


def bearing_friction(speed, f0, viscosity, diameter, f1, load):
    """Loss of a rolling bearing: P = 2 pi n (M0 + M1), M0 by Palmgren, M1 = f1 P1 d_m.

    With nu in mm^2/s, n in 1/min and d_m in mm: M0 = 1e-7 f0 (nu n)^(2/3) d_m^3 N mm for nu n >= 2000,
    else 160e-7 f0 d_m^3 N mm. Source: paper 002 eqs (4)-(6), ISO 15312; errata E-002-1 (2 pi), E-002-4 (low speed).
    speed [1/s], f0 [1], viscosity [m^2/s], diameter d_m [m], f1 [1], load P1 [N].
    """
    n = jnp.abs(speed)
    d = diameter * 1e3  # mm
    nu_n = viscosity * 1e6 * n * 60.0
    viscous = jnp.where(nu_n >= 2000.0, 1e-7 * jnp.maximum(nu_n, 2000.0) ** (2.0 / 3.0), 160e-7)
    torque = f0 * viscous * d**3 * 1e-3 + f1 * load * diameter  # N m
    return 2.0 * jnp.pi * n * torque
