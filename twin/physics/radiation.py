"""Linearised radiation to the surroundings as a film coefficient."""

from __future__ import annotations

STEFAN_BOLTZMANN = 5.670374419e-8  # W/(m^2 K^4), CODATA 2018
ZERO_CELSIUS = 273.15  # K


def radiation_coefficient(surface, radiant, emissivity):
    """Film coefficient of grey radiation into large surroundings [W/(m^2 K)]: eps sigma (Ts^2 + Tr^2)(Ts + Tr).

    Times (surface - radiant) it is the exact heat flux eps sigma (Ts^4 - Tr^4); for Ts = Tr = T it is 4 eps sigma T^3.
    surface, radiant [degC] (mean radiant temperature of what the surface sees); emissivity [1], 0 to 1.
    Numbers, numpy and JAX arrays alike, of shapes that broadcast. Holds for a small body in large surroundings.
    Source: Stefan-Boltzmann law; erratum E-004-3 of paper 004, which leaves radiation out although 5.41 W/(m^2 K)
    (eps = 0.9, 25 degC) exceeds its free convection.
    """
    s = surface + ZERO_CELSIUS
    r = radiant + ZERO_CELSIUS
    return emissivity * STEFAN_BOLTZMANN * (s**2 + r**2) * (s + r)
