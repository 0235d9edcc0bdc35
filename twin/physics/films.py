"""Film coefficients as literature values or assumptions [W/(m^2 K)]."""

from __future__ import annotations

import jax.numpy as jnp


def constant_film(natural):
    """Natural convection as a literature value. Source: paper 000 eq (7), natural part."""
    return jnp.asarray(natural)


def forced_film(speed, natural, forced, exponent):
    """alpha = alpha_natural + alpha_forced |v|^m with v in m/s. Source: paper 000 eq (7).

    The forced part of moving components is a free parameter in paper 000; m = 0.8 as for a turbulent plate
    (Nu ~ Re^0.8, VDI-Waermeatlas). Its derivative by speed, infinite at rest, is taken as zero there.
    """
    v = jnp.abs(speed)
    power = jnp.where(v > 0.0, v, 1.0) ** exponent
    return natural + forced * jnp.where(v > 0.0, power, 0.0)


def logged_film(coefficient):
    """A film coefficient that is logged or known beforehand: alpha = coefficient. Source: definition."""
    return jnp.asarray(coefficient)


def switched_film(switch, natural):
    """A film that is switched, such as a coolant or a blast of air: alpha = alpha_on s, s = 0 off, 1 on.

    An assumed form: between them s is the share of time on; off, it exchanges nothing. What the surface exchanges
    besides belongs to its own film.
    """
    return switch * natural


def enclosed_gap(conductance):
    """Heat through an enclosed gap or a cover, convection and radiation together, as a conductance per area.

    An assumed value: the papers have no correlation for covers and gaps. A candidate for calibration.
    """
    return jnp.asarray(conductance)
