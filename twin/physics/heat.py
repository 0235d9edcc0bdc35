"""Heat that is known as such, or as a share of a logged power [W]."""

from __future__ import annotations

import jax.numpy as jnp


def constant_heat(power):
    """A constant heat: electronics, a pump, a hydraulic unit. power [W]."""
    return jnp.asarray(power)


def switched_heat(switch, power):
    """A heat that is switched: power [W] times the signal (0 off, 1 on, between them the share of time on)."""
    return switch * power


def power_share(power, share):
    """The share of a logged power that stays as heat: share |P|. power [W], of cutting, a drive, a pump."""
    return share * jnp.abs(power)
