"""Heat that is known as such, or as a share of a logged power [W]."""

from __future__ import annotations

import jax.numpy as jnp

from twin.physics.powers import power as power_of


def constant_heat(power):
    """A constant heat: electronics, a pump, a hydraulic unit. power [W]."""
    return jnp.asarray(power)


def switched_heat(switch, power):
    """A heat that is switched: power [W] times the signal (0 off, 1 on, between them the share of time on)."""
    return switch * power


def speed_heat(speed, power, reference, exponent):
    """Friction of a moving axis by a power of its speed: P = power (|v| / reference)^exponent, v and reference [m/s].

    An assumed form with one strength and one shape: exponent 1 as of a constant force, 2 as of a viscous one (paper 004
    eq (6) has the first). Its derivative by the speed is taken as zero at rest.
    """
    return power * power_of(jnp.abs(speed) / reference, exponent)


def turning_heat(speed, power, reference, exponent):
    """Friction of a spindle or motor by a power of its speed: P = power (|n| / reference)^exponent, in 1/s.

    An assumed form with one strength and one shape: exponent 1 as of a constant torque, 5/3 as of a bearing's lubricant
    (paper 002 eqs (4)-(6): M0 ~ n^(2/3)), 2 as of eddy currents. Its derivative is taken as zero at rest.
    """
    return power * power_of(jnp.abs(speed) / reference, exponent)


def power_share(power, share):
    """The share of a logged power that stays as heat: share |P|. power [W], of cutting, a drive, a pump."""
    return share * jnp.abs(power)
