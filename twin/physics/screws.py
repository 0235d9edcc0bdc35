"""Friction heat of ball screws [W]. Arguments are numbers or arrays in SI units."""

from __future__ import annotations

import jax.numpy as jnp


def screw_efficiency(diameter, lead, friction):
    """eta = tan(phi) / tan(phi + rho), tan(phi) = L/(pi d), tan(rho) = mu. Source: paper 002 eq (10).

    diameter d [m] of the pitch circle, lead L [m], friction mu [1].
    """
    phi = jnp.arctan(lead / (jnp.pi * diameter))
    return jnp.tan(phi) / jnp.tan(phi + jnp.arctan(friction))


def screw_friction(speed, force, preload, diameter, lead, friction):
    """Loss of a driven ball screw with preloaded nut: P = 2 pi n (M_d + M_pl).

    n = |v|/L; M_d = F L (1 - eta)/(2 pi eta), M_pl = F_p L (1 - eta^2)/(2 pi eta), eta by screw_efficiency.
    The force counts by its size, as one against the motion, whatever the sign of F v: the screw drives it. Where the
    load drives the screw for part of the way, its loss comes out larger by 1/eta, 4 % for usual screws.
    speed [m/s], force F [N], preload F_p [N], diameter d [m], lead L [m], friction mu [1].
    Source: paper 002 eqs (7)-(10) with errata E-002-2 (printed pi n, half of the power) and E-002-7 (printed without
    the 1/eta of the driven case).
    """
    eta = screw_efficiency(diameter, lead, friction)
    return screw_back_driven(speed, force, preload, diameter, lead, friction) / eta


def screw_friction_holds(speed, force, preload, diameter, lead, friction):
    """0 < eta <= 1: mu tan(phi) < 1, else no torque turns the screw and the law's loss is negative."""
    return friction * lead / (jnp.pi * diameter) < 1.0


def screw_back_driven(speed, force, preload, diameter, lead, friction):
    """Loss of a ball screw that its load drives, an axis going down: P = 2 pi n (M_d + M_pl).

    M_d = F L (1 - eta)/(2 pi), M_pl = F_p L (1 - eta^2)/(2 pi): of the power F v, eta F v reaches the motor.
    Arguments as screw_friction. Source: paper 002 eqs (7)-(10) with erratum E-002-2; as printed, (8) and (9) are the
    back-driven forms (E-002-7). They take eta of eq (10) for both ways; the exact tan(phi - rho)/tan(phi) of this one
    makes the loss of the load larger by about mu/tan(phi), 4 % of it for usual screws.
    """
    eta = screw_efficiency(diameter, lead, friction)
    n = jnp.abs(speed) / lead
    m_load = jnp.abs(force) * lead * (1.0 - eta) / (2.0 * jnp.pi)
    m_preload = preload * lead * (1.0 - eta**2) / (2.0 * jnp.pi)
    return 2.0 * jnp.pi * n * (m_load + m_preload)


def screw_back_driven_holds(speed, force, preload, diameter, lead, friction):
    """tan(phi) > mu, a screw that is not self-locking, and 0 < eta <= 1."""
    driven = screw_friction_holds(speed, force, preload, diameter, lead, friction)
    return driven & (lead / (jnp.pi * diameter) > friction)
