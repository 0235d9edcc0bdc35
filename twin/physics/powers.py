"""Powers and magnitudes with finite derivatives at zero, where machines stand still or are as warm as the air."""

from __future__ import annotations

import jax.numpy as jnp


def power(x, exponent):
    """x^exponent for x >= 0; its derivative, infinite or undefined at x = 0 for exponents below one, is zero there."""
    positive = x > 0.0
    return jnp.where(positive, jnp.where(positive, x, 1.0) ** exponent, 0.0)


def magnitude(x, smallest):
    """|x|, rounded off to `smallest` at x = 0: sqrt(x^2 + smallest^2), differentiable everywhere."""
    return jnp.sqrt(x**2 + smallest**2)
