"""Nusselt numbers of forced and mixed convection by Reynolds and Prandtl number.

Re = v L / nu with properties at the film temperature; Nu = h L / k with the same length L.
Numbers and arrays; derivatives are finite, at Re = 0 too. Ranges are stated, not enforced: the laws flag them.
Sources: VDI-Waermeatlas, part G; Incropera and DeWitt, Fundamentals of Heat and Mass Transfer; they replace the lost
Table 3 of paper 004.
"""

from __future__ import annotations

import jax.numpy as jnp

from twin.physics.powers import power

TRANSITION = 5e5  # Re at which the boundary layer of a smooth plate turns turbulent
HILPERT = ((4.0, 0.989, 0.330), (40.0, 0.911, 0.385), (4e3, 0.683, 0.466), (4e4, 0.193, 0.618), (4e5, 0.027, 0.805))


def plate_laminar(re, pr):
    """G1: 0.664 Re^(1/2) Pr^(1/3); L along the flow; Re < 5e5 (VDI: 1e5), Pr >= 0.6. Pohlhausen 1921."""
    return 0.664 * power(re, 0.5) * pr ** (1 / 3)


def plate_turbulent(re, pr):
    """G2: 0.037 Re^0.8 Pr / [1 + 2.443 Re^(-0.1) (Pr^(2/3) - 1)]; 5e5 < Re < 1e7, 0.6 < Pr < 2000.

    Source: Petukhov and Popov 1963 as used by Gnielinski, VDI-Waermeatlas. Below Re = 1, where the denominator of air
    would pass through zero, it is held.
    """
    denominator = 1.0 + 2.443 * jnp.maximum(re, 1.0) ** -0.1 * (pr ** (2 / 3) - 1.0)
    return 0.037 * power(re, 0.8) * pr / denominator


def plate(re, pr):
    """G3: sqrt(Nu_lam^2 + Nu_turb^2) for any technical inflow; 10 < Re < 1e7. Gnielinski, VDI-Waermeatlas."""
    return power(plate_laminar(re, pr) ** 2 + plate_turbulent(re, pr) ** 2, 0.5)


def plate_turbulent_incropera(re, pr):
    """G4: 0.037 Re^(4/5) Pr^(1/3), turbulent from the leading edge; Re > 5e5, 0.6 < Pr < 60. Incropera."""
    return 0.037 * power(re, 0.8) * pr ** (1 / 3)


def plate_mixed_incropera(re, pr):
    """G4: (0.037 Re^(4/5) - 871) Pr^(1/3) behind a laminar start; 5e5 < Re < 1e8, 0.6 < Pr < 60. Incropera.

    The printed form is negative below Re = 2.9e5. Below the transition at 5e5, where both agree to 0.1 %, G1 holds.
    """
    mixed = (0.037 * power(re, 0.8) - 871.0) * pr ** (1 / 3)
    return jnp.where(re < TRANSITION, plate_laminar(re, pr), mixed)


def cylinder(re, pr):
    """G5: cylinder in cross flow: 0.3 + 0.62 Re^(1/2) Pr^(1/3) / [1 + (0.4/Pr)^(2/3)]^(1/4)
    [1 + (Re/282000)^(5/8)]^(4/5); L = diameter; Re Pr >= 0.2. Churchill and Bernstein 1977.
    """
    laminar = 0.62 * power(re, 0.5) * pr ** (1 / 3) / (1.0 + (0.4 / pr) ** (2 / 3)) ** 0.25
    return 0.3 + laminar * (1.0 + power(re / 282000.0, 5 / 8)) ** 0.8


def cylinder_hilpert(re, pr):
    """G6: C Re^m Pr^(1/3) with C, m by range of Re from 0.4 to 4e5 (HILPERT); L = diameter; Pr >= 0.7. Hilpert 1933.

    Below and above, the first and last pair are continued.
    """
    value = HILPERT[-1][1] * power(re, HILPERT[-1][2])
    for end, c, m in reversed(HILPERT[:-1]):
        value = jnp.where(re < end, c * power(re, m), value)
    return value * pr ** (1 / 3)


def bar(re, pr, constant, exponent):
    """G7: C Re^m Pr^(1/3), bars that are not round in cross flow; L = height across the flow; 5e3 < Re < 1e5.

    Square, face on: 0.102, 0.675; square, edge on: 0.246, 0.588; hexagon: 0.153, 0.638. Source: Incropera,
    Table 7.3 (after Jakob 1949); the constants agree with those of Mechanical Engineers' Handbook, vol. 4, Table 13,
    but were not checked in the original.
    """
    return constant * power(re, exponent) * pr ** (1 / 3)


def rotating_cylinder(re, pr):
    """G8: shaft turning in still air: 0.133 Re^(2/3) Pr^(1/3), Re = omega D^2 / nu < 4.3e5; L = diameter.

    Source: Becker, Int. J. Heat Mass Transfer 6 (1963) 1053; not checked in the original.
    """
    return 0.133 * power(re, 2 / 3) * pr ** (1 / 3)


def mixed(forced, free, opposing=False):
    """G9: free and forced flow together: Nu^3 = |Nu_F^3 + Nu_N^3|, minus where the flows oppose each other.

    Both numbers (or both film coefficients) belong to one length. Without one of the flows it is the other's value.
    Opposing flows of equal strength give zero, as the formula has it. Source: VDI-Waermeatlas; Churchill 1977.
    """
    return power(jnp.abs(forced**3 + jnp.where(opposing, -1.0, 1.0) * free**3), 1 / 3)


def property_correction(ambient, surface):
    """G10: factor (Tair/Tsurface)^0.12 [K] on Nu of a gas whose properties are taken at the air's temperature. VDI.

    ambient, surface [degC]. The laws take properties at the film temperature instead, and do not use it: both
    together would count the same effect twice.
    """
    return ((ambient + 273.15) / (surface + 273.15)) ** 0.12
