"""Linearised radiation against the fourth powers."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from twin.physics.radiation import radiation_coefficient


def test_paint_at_25_degrees():
    """Erratum E-004-3: 5.41 W/(m^2 K), more than the free convection of 2.5 to 4.5 that paper 004 keeps."""
    assert radiation_coefficient(25.0, 25.0, 0.9) == pytest.approx(5.41, abs=0.005)


def test_times_the_difference_it_is_the_heat_of_stefan_and_boltzmann():
    surface, radiant = np.array([-10.0, 22.0, 40.0, 120.0]), 20.0
    flux = 5.670374419e-8 * 0.8 * ((surface + 273.15) ** 4 - (radiant + 273.15) ** 4)
    h = radiation_coefficient(surface, radiant, 0.8)
    assert isinstance(h, np.ndarray)
    np.testing.assert_allclose(h * (surface - radiant), flux, rtol=1e-12)
    np.testing.assert_allclose(radiation_coefficient(jnp.asarray(surface), radiant, 0.8), h, rtol=1e-15)


def test_the_gradient_is_the_analytic_one():
    assert jax.grad(radiation_coefficient)(25.0, 25.0, 0.9) == pytest.approx(
        0.9 * 5.670374419e-8 * 6 * 298.15**2, rel=1e-9
    )
