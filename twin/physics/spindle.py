"""Heat of a spindle [W]."""

from __future__ import annotations

from dataclasses import dataclass

from twin.physics.bearings import bearing_friction
from twin.physics.grouped import Value, grouped
from twin.physics.heat import power_share


@dataclass(frozen=True)
class Bearing:
    """One bearing, as in bearing_friction."""

    f0: Value  # 1
    viscosity: Value  # m^2/s
    diameter: Value  # m
    f1: Value  # 1
    load: Value  # N


@grouped
def spindle(speed, power, bearing: Bearing, bearings, share):
    """Idle friction of the spindle's bearings and a share of the cutting power: P = N 2 pi n (M0 + M1) + s |P_cut|.

    speed n [1/s], power P_cut [W]; f0, viscosity, diameter, f1 and load (preload and cutting force) of one bearing as
    in bearing_friction; bearings N; share s of the power that stays in the spindle as heat, about 1 - efficiency.
    Source: paper 002 eqs (4)-(6) and (11) with errata E-002-1, E-002-3 and E-002-4; paper 000 names spindle heat as a
    source without a formula.
    """
    friction = bearing_friction(speed, bearing.f0, bearing.viscosity, bearing.diameter, bearing.f1, bearing.load)
    return bearings * friction + power_share(power, share)
