"""Film coefficient of a coolant channel, referred to the coolant's inlet temperature."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp

from twin.physics.grouped import Value, grouped
from twin.physics.powers import power

LAMINAR, TURBULENT = 2300.0, 1e4


def friction_factor(re):
    """Konakov's factor of smooth tubes: (1.8 log10 Re - 1.5)^-2; 1e4 <= Re <= 1e6. Source: VDI-Waermeatlas G1."""
    return (1.8 * jnp.log10(re) - 1.5) ** -2


def tube_laminar(re, pr, slenderness):
    """Mean Nu of laminar tube flow at constant wall temperature: [3.66^3 + 0.7^3 + (1.615 (Re Pr d/L)^(1/3) - 0.7)^3]
    ^(1/3); slenderness = d/L; Re <= 2300. Source: VDI-Waermeatlas G1 (Gnielinski).
    """
    entrance = (1.615 * power(re * pr * slenderness, 1 / 3) - 0.7) ** 3
    return (3.66**3 + 0.7**3 + entrance) ** (1 / 3)


def tube_turbulent(re, pr, slenderness):
    """Mean Nu of turbulent tube flow: (f/8) Re Pr / [1 + 12.7 (f/8)^(1/2) (Pr^(2/3) - 1)] [1 + (d/L)^(2/3)].

    slenderness = d/L; 1e4 <= Re <= 1e6, 0.1 <= Pr <= 1000, d/L <= 1. Source: VDI-Waermeatlas G1 (Gnielinski).
    """
    eighth = friction_factor(re) / 8.0
    developed = eighth * re * pr / (1.0 + 12.7 * eighth**0.5 * (pr ** (2 / 3) - 1.0))
    return developed * (1.0 + slenderness ** (2 / 3))


def tube(re, pr, slenderness):
    """Mean Nu of a smooth tube: laminar to Re = 2300, turbulent from 1e4, between them linear in Re.

    slenderness = d/L. Source: VDI-Waermeatlas G1; Gnielinski, Int. J. Heat Mass Transfer 63 (2013) 134.
    """
    way = jnp.clip((re - LAMINAR) / (TURBULENT - LAMINAR), 0.0, 1.0)
    low = tube_laminar(jnp.minimum(re, LAMINAR), pr, slenderness)
    high = tube_turbulent(jnp.maximum(re, TURBULENT), pr, slenderness)
    return (1.0 - way) * low + way * high


def _reynolds(flow, diameter, viscosity):
    return 4.0 * jnp.abs(flow) / (jnp.pi * diameter * viscosity)


@dataclass(frozen=True)
class Channel:
    """A channel and the film on its walls."""

    diameter: Value  # m
    channel_length: Value  # m
    area: Value  # m^2
    still: Value  # W/(m^2 K)


@dataclass(frozen=True)
class Coolant:
    """What flows through a channel."""

    density: Value  # kg/m^3
    heat_capacity: Value  # J/(kg K)
    conductivity: Value  # W/(m K)
    viscosity: Value  # m^2/s

    @property
    def prandtl(self) -> Value:
        return self.viscosity * self.density * self.heat_capacity / self.conductivity


@grouped
def coolant_channel(flow, channel: Channel, coolant: Coolant):
    """h of the wall of a coolant channel against the coolant's inlet temperature.

    h = h_still + rho c V (1 - exp(-NTU)) / A, NTU = h_wall pi d L / (rho c V), h_wall = Nu k / d by Gnielinski.
    The coolant warms on its way, so that a channel takes up no more than rho c V (Twall - Tinlet): with the inlet as
    environment, heat balances stay exact without a temperature of the coolant. Its outlet is Tinlet + heat / (rho c V).
    flow V [m^3/s], diameter d and channel_length L [m], area A [m^2] of the surfaces the film is laid on (the walls as
    they are meshed, which need not be pi d L), still [W/(m^2 K)] the coefficient at rest, which keeps it above zero;
    density [kg/m^3], heat_capacity [J/(kg K)], conductivity [W/(m K)], viscosity [m^2/s] of the coolant.
    Holds for a wall of one temperature and Re < 1e6.
    Source: effectiveness of a stream along an isothermal wall, VDI-Waermeatlas C1; Nu: VDI-Waermeatlas G1. Stands for
    the cooler of paper 004 eq (4), which knows neither flow nor inlet temperature (erratum E-004-4).
    """
    volume = jnp.abs(flow)
    pr = coolant.prandtl
    nu = tube(_reynolds(flow, channel.diameter, coolant.viscosity), pr, channel.diameter / channel.channel_length)
    wall = nu * coolant.conductivity * jnp.pi * channel.channel_length  # W/K
    stream = coolant.density * coolant.heat_capacity * volume  # W/K
    moving = stream > 0.0
    units = jnp.where(moving, wall / jnp.where(moving, stream, 1.0), 0.0)
    return channel.still - stream * jnp.expm1(-units) / channel.area


@grouped
def coolant_channel_holds(flow, channel: Channel, coolant: Coolant):
    """Re < 1e6, 0.1 <= Pr <= 1000, d <= L."""
    pr = coolant.prandtl
    fluid = (pr >= 0.1) & (pr <= 1000.0) & (channel.diameter <= channel.channel_length)
    return fluid & (_reynolds(flow, channel.diameter, coolant.viscosity) < 1e6)
