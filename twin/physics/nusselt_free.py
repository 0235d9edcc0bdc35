"""Nusselt numbers of free convection by Rayleigh and Prandtl number.

Ra = g beta |Ts - Tair| L^3 / (nu a) with properties at the film temperature; Nu = h L / k with the same length L.
Numbers and arrays; derivatives are finite, at Ra = 0 too. Ranges are stated, not enforced: the laws flag them.
Sources: VDI-Waermeatlas, section F2 (Klan and Thess); Incropera and DeWitt, Fundamentals of Heat and Mass Transfer;
they replace the lost Table 2 of paper 004.
"""

from __future__ import annotations

import jax.numpy as jnp

from twin.physics.powers import power

SWITCH_UP = 7e4  # Ra f2 at which flow over a hot plate turns turbulent


def f1(pr):
    """Prandtl function of vertical plates and of hot plates facing down: [1 + (0.492/Pr)^(9/16)]^(-16/9)."""
    return (1.0 + (0.492 / pr) ** (9 / 16)) ** (-16 / 9)


def f2(pr):
    """Prandtl function of hot plates facing up: [1 + (0.322/Pr)^(11/20)]^(-20/11).

    The exponent is negative. A widely used program has +20/11, which makes Nu of air 1.8 times too large.
    """
    return (1.0 + (0.322 / pr) ** (11 / 20)) ** (-20 / 11)


def f3(pr):
    """Prandtl function of horizontal cylinders: [1 + (0.559/Pr)^(9/16)]^(-16/9)."""
    return (1.0 + (0.559 / pr) ** (9 / 16)) ** (-16 / 9)


def vertical_plate(ra, pr):
    """F1: (0.825 + 0.387 (Ra f1)^(1/6))^2; L = height; 0.1 < Ra < 1e12, every Pr. Churchill and Chu 1975; VDI F2."""
    return (0.825 + 0.387 * power(ra * f1(pr), 1 / 6)) ** 2


def vertical_plate_laminar(ra, pr):
    """F1l: 0.68 + 0.670 Ra^(1/4) / [1 + (0.492/Pr)^(9/16)]^(4/9); L = height; Ra <= 1e9. Churchill and Chu 1975."""
    return 0.68 + 0.670 * power(ra, 0.25) / (1.0 + (0.492 / pr) ** (9 / 16)) ** (4 / 9)


def inclined_plate_stable(ra, pr, angle):
    """F2: F1 with g cos(theta), for the hot side facing down or the cold side facing up.

    angle theta [rad] from the vertical, 0 to 60 degrees; L = length along the slope; laminar, Ra cos(theta) <= 1e9.
    """
    return vertical_plate(ra * jnp.cos(angle), pr)


def transition_of_inclined_plate(angle):
    """Ra at which flow on the hot upper side of an inclined plate separates: 10^(8.9 - 0.00178 theta^1.82), degrees."""
    return 10.0 ** (8.9 - 0.00178 * power(jnp.abs(jnp.rad2deg(angle)), 1.82))


def inclined_plate_unstable(ra, pr, angle):
    """F3: hot side facing up, or cold side facing down: F2 to the transition Ra_c, beyond it
    0.56 (Ra_c cos(theta))^(1/4) + 0.13 (Ra^(1/3) - Ra_c^(1/3)).

    angle theta [rad] from the vertical, 0 to 60 degrees; L = length along the slope. Source: VDI-Waermeatlas F2.
    The published pair jumps at Ra_c, by 8 to 18 % in air.
    """
    critical = transition_of_inclined_plate(angle)
    beyond = 0.56 * (critical * jnp.cos(angle)) ** 0.25 + 0.13 * (power(ra, 1 / 3) - critical ** (1 / 3))
    return jnp.where(ra > critical, beyond, inclined_plate_stable(ra, pr, angle))


def horizontal_up(ra, pr):
    """F4: hot side up or cold side down: 0.766 (Ra f2)^(1/5) to Ra f2 = 7e4, then 0.15 (Ra f2)^(1/3).

    L = area over perimeter. Source: VDI-Waermeatlas F2. One public program switches at 7e-4 instead of 7e4.
    """
    x = ra * f2(pr)
    return jnp.where(x <= SWITCH_UP, 0.766 * power(x, 0.2), 0.15 * power(x, 1 / 3))


def horizontal_up_incropera(ra, pr):
    """F4i: the same after McAdams and Incropera: 0.54 Ra^(1/4) (1e4 to 1e7), 0.15 Ra^(1/3) (to 1e11); Pr >= 0.7.

    35 to 55 % above F4: the spread of the literature, hence the uncertainty of a film before it is calibrated.
    """
    return jnp.where(ra <= 1e7, 0.54 * power(ra, 0.25), 0.15 * power(ra, 1 / 3))


def horizontal_down(ra, pr):
    """F5: hot side down or cold side up: 0.6 (Ra f1)^(1/5); 1e3 < Ra f1 < 1e10; L = area over perimeter. VDI F2."""
    return 0.6 * power(ra * f1(pr), 0.2)


def horizontal_down_incropera(ra, pr):
    """F5i: the same in Incropera's 7th edition: 0.52 Ra^(1/5); 1e4 to 1e9, Pr >= 0.7; L = area over perimeter."""
    return 0.52 * power(ra, 0.2)


def horizontal_down_incropera_6(ra, pr):
    """F5i: the same in Incropera's 6th edition: 0.27 Ra^(1/4); 1e5 to 1e10; L = area over perimeter."""
    return 0.27 * power(ra, 0.25)


def horizontal_cylinder(ra, pr):
    """F6: (0.60 + 0.387 (Ra f3)^(1/6))^2; L = diameter; Ra <= 1e12. Churchill and Chu 1975."""
    return (0.60 + 0.387 * power(ra * f3(pr), 1 / 6)) ** 2


def horizontal_cylinder_vdi(ra, pr):
    """F6v: (0.752 + 0.387 (Ra f3)^(1/6))^2; L = pi D / 2 (Ra and Nu alike). VDI-Waermeatlas F2."""
    return (0.752 + 0.387 * power(ra * f3(pr), 1 / 6)) ** 2


def vertical_cylinder(ra, pr, slenderness):
    """F7: F1 where D/L >= 35/Gr^(1/4), else F1 times 1 + B (32^(1/2) Gr^(-1/4) L/D)^C.

    slenderness = L/D; L = height; B = 0.0571322 + 0.20305 Pr^(-0.43),
    C = 0.9165 - 0.0043 Pr^(1/2) + 0.01333 ln Pr + 0.0004809/Pr; 0.01 < Pr < 100.
    Source: Popiel 2008, as in the source of the program ht, which notes that reprints have 32^2 for 32^(1/2).
    """
    curvature = slenderness / power(jnp.maximum(ra / pr, 1e-12), 0.25)
    b = 0.0571322 + 0.20305 * pr**-0.43
    c = 0.9165 - 0.0043 * pr**0.5 + 0.01333 * jnp.log(pr) + 0.0004809 / pr
    slender = 1.0 + b * (32.0**0.5 * curvature) ** c
    return vertical_plate(ra, pr) * jnp.where(35.0 * curvature <= 1.0, 1.0, slender)


def vertical_cylinder_vdi(ra, pr, slenderness):
    """F7, alternative: F1 + 0.435 L/D; L = height. VDI-Waermeatlas F2; 0.435 was not checked in the original."""
    return vertical_plate(ra, pr) + 0.435 * slenderness
