"""Thermal conductance of bolted joints [W/(m^2 K)]: through the metal in contact and through the gas between.

Source: paper 004 eqs (7)-(10); solid part: Cooper, Mikic and Yovanovich, Int. J. Heat Mass Transfer 12 (1969) 279, with
Yovanovich's exponent 0.95; gas part: Yovanovich, DeVaal and Hegazy 1982.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp

from twin.physics.grouped import Value, grouped
from twin.physics.powers import power

# Relative pressures p/H of contacts, between which the separation has been fitted.
LEAST, MOST = 1e-6, 2.3e-2


def bolt_force(torque, pitch, flank_diameter, friction, hole_diameter, head_diameter):
    """Preload [N] of a bolt from its tightening torque: M_A / [0.16 P + mu (0.58 d2 + (d_h + d_w)/4)].

    torque M_A [N m], pitch P [m], flank_diameter d2 [m], friction mu of thread and head, hole_diameter d_h [m],
    head_diameter d_w [m]. Source: VDI 2230; paper 004 eq (10) with erratum E-004-5: its bracket is misplaced.
    """
    bearing = 0.58 * flank_diameter + 0.25 * (hole_diameter + head_diameter)
    return torque / (0.16 * pitch + friction * bearing)


def solid_conductance(conductivity_1, conductivity_2, roughness_1, roughness_2, slope_1, slope_2, pressure, hardness):
    """h_s = 1.25 k_s m/sigma (p/H)^0.95 with k_s = 2 k1 k2/(k1 + k2), sigma and m the root of the sum of squares.

    conductivity [W/(m K)], roughness [m rms], slope [1] of both surfaces; pressure p and contact hardness H [Pa].
    Source: paper 004 eq (8).
    """
    k = 2.0 * conductivity_1 * conductivity_2 / (conductivity_1 + conductivity_2)
    sigma = jnp.sqrt(roughness_1**2 + roughness_2**2)
    slope = jnp.sqrt(slope_1**2 + slope_2**2)
    return 1.25 * k * slope / sigma * power(pressure / hardness, 0.95)


def separation(pressure, hardness):
    """lambda = Y/sigma = 1.53 (p/H)^-0.097, the distance of the mean planes over the roughness.

    p/H is held between 1e-6 and 2.3e-2. Source: Yovanovich's fit to separation_exact.
    """
    return 1.53 * jnp.clip(pressure / hardness, LEAST, MOST) ** -0.097


def separation_exact(pressure, hardness):
    """lambda = sqrt(2) erfc^-1(2 p/H), for 0 < p/H < 1/2 (paper 004; Gaussian heights)."""
    return jnp.sqrt(2.0) * jax.scipy.special.erfinv(1.0 - 2.0 * pressure / hardness)


def rarefaction(accommodation_1, accommodation_2, free_path, adiabatic_exponent, prandtl):
    """B = [(2 - a1)/a1 + (2 - a2)/a2] [2 g/(Pr (g + 1))] Lambda [m]: the jump of temperature at the walls, as a length.

    accommodation a1, a2 of gas and walls, free_path Lambda [m] (air: 0.064 to 0.068 um), adiabatic_exponent g.
    Source: Yovanovich, DeVaal and Hegazy 1982 (erratum E-004-8: paper 004 gives none); not checked in the original.
    """
    accommodation = (2.0 - accommodation_1) / accommodation_1 + (2.0 - accommodation_2) / accommodation_2
    return accommodation * 2.0 * adiabatic_exponent / (prandtl * (adiabatic_exponent + 1.0)) * free_path


def gap_factor(sigma, rarefaction_length, relative_separation):
    """f_g, by which the uneven gap conducts better than an even one of its mean width.

    1.063 + 0.0471 (4 - lambda)^1.68 (ln(sigma/B))^0.84 for 0.01 <= B/sigma <= 1, 1 + 0.06 (sigma/B)^0.8 beyond;
    2 <= lambda <= 4. Source: Negus and Yovanovich, as in Yovanovich's handbook chapters (erratum E-004-8: paper 004
    gives none); not checked in the original.
    """
    ratio = sigma / rarefaction_length
    rough = 1.063 + 0.0471 * power(4.0 - relative_separation, 1.68) * power(jnp.log(jnp.maximum(ratio, 1.0)), 0.84)
    return jnp.where(ratio >= 1.0, rough, 1.0 + 0.06 * power(jnp.minimum(ratio, 1.0), 0.8))


def gas_conductance(gas_conductivity, sigma, rarefaction_length, relative_separation, factor):
    """h_g = k_g f_g / (B + lambda sigma); gas_conductivity k_g [W/(m K)], sigma and B [m]. Paper 004 eq (9)."""
    return gas_conductivity * factor / (rarefaction_length + relative_separation * sigma)


@dataclass(frozen=True)
class Surfaces:
    """Two surfaces in contact."""

    conductivity_1: Value  # W/(m K)
    conductivity_2: Value
    roughness_1: Value  # m rms
    roughness_2: Value
    slope_1: Value  # 1, mean of the profile
    slope_2: Value
    hardness: Value  # Pa, contact hardness of the softer one

    @property
    def roughness(self) -> Value:
        """sigma [m rms] of the gap between them."""
        return jnp.sqrt(self.roughness_1**2 + self.roughness_2**2)


@dataclass(frozen=True)
class Clamping:
    """What presses a joint together: a pressure, or where that is 0 bolts over an area."""

    pressure: Value  # Pa
    bolts: Value  # 1
    torque: Value  # N m, and the geometry of one bolt as in bolt_force
    pitch: Value  # m
    flank_diameter: Value  # m
    bolt_friction: Value  # 1
    hole_diameter: Value  # m
    head_diameter: Value  # m
    area: Value  # m^2 that the bolts press on

    @property
    def contact_pressure(self) -> Value:
        """Pressure [Pa] given, or (0) that of the bolts; 0 with neither."""
        bolted = (self.bolts > 0.0) & (self.area > 0.0) & (self.pitch > 0.0)
        pitch = jnp.where(bolted, self.pitch, 1.0)
        force = bolt_force(
            self.torque, pitch, self.flank_diameter, self.bolt_friction, self.hole_diameter, self.head_diameter
        )
        from_bolts = jnp.where(bolted, self.bolts * force / jnp.where(self.area > 0.0, self.area, 1.0), 0.0)
        return jnp.where(self.pressure > 0.0, self.pressure, from_bolts)


@dataclass(frozen=True)
class Gap:
    """What fills a joint between the spots of contact."""

    gas_conductivity: Value  # W/(m K)
    rarefaction_length: Value  # m, B
    factor: Value  # 1, f_g; 0: by gap_factor


@grouped
def bolted_joint(surfaces: Surfaces, clamping: Clamping, gap: Gap):
    """h_c = h_s + h_g of a joint under a pressure [Pa], given or (0) that of its bolts over `area` [m^2].

    Solid and gas parts by solid_conductance and gas_conductance; factor f_g given, or (0) by gap_factor. An oiled or
    glued joint: its conductivity for gas_conductivity, rarefaction_length 0 and factor 1. With neither pressure nor
    bolts there is no joint: 0, which a description is refused for.
    Source: paper 004 eqs (7)-(10) with errata E-004-5 and E-004-8.
    """
    p = clamping.contact_pressure
    solid = solid_conductance(
        surfaces.conductivity_1, surfaces.conductivity_2, surfaces.roughness_1, surfaces.roughness_2,
        surfaces.slope_1, surfaces.slope_2, p, surfaces.hardness,
    )  # fmt: skip
    sigma = surfaces.roughness
    planes = separation(p, surfaces.hardness)
    thin = jnp.maximum(gap.rarefaction_length, 0.01 * sigma)  # the fitted range of f_g ends there
    f_g = jnp.where(gap.factor > 0.0, gap.factor, gap_factor(sigma, thin, planes))
    gas = gas_conductance(gap.gas_conductivity, sigma, gap.rarefaction_length, planes, f_g)
    return jnp.where(p > 0.0, solid + gas, 0.0)


@grouped
def bolted_joint_holds(surfaces: Surfaces, clamping: Clamping, gap: Gap):
    """1e-6 <= p/H <= 2.3e-2; with f_g by gap_factor also B/sigma >= 0.01 and 2 <= lambda <= 4."""
    relative = clamping.contact_pressure / surfaces.hardness
    planes = separation(relative, 1.0)
    fitted = (gap.rarefaction_length >= 0.01 * surfaces.roughness) & (planes >= 2.0) & (planes <= 4.0)
    return (relative >= LEAST) & (relative <= MOST) & ((gap.factor > 0.0) | fitted)
