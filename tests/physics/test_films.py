"""Film coefficients against numbers worked out by hand."""

import jax
import numpy as np
import pytest

from twin.physics import films

FORCED = {"natural": 6.0, "forced": 20.0, "exponent": 0.8}


def test_natural_convection_is_the_literature_value():
    assert films.constant_film(natural=8.0) == 8.0
    assert jax.grad(films.constant_film)(8.0) == 1.0


@pytest.mark.parametrize(("speed", "film"), [(0.0, 6.0), (1.0, 26.0), (-1.0, 26.0), (0.5, 17.4870), (2.0, 40.8220)])
def test_forced_convection(speed, film):
    """Paper 000 eq (7): the natural part at rest, the forced part added by |v|^0.8."""
    assert films.forced_film(speed=speed, **FORCED) == pytest.approx(film, abs=1e-4)


def test_gradients_are_those_of_differences():
    point = {"speed": -0.3, **FORCED}
    gradient = jax.grad(lambda values: films.forced_film(**values))(point)
    for name, value in point.items():
        step = 1e-6 * abs(value)
        change = films.forced_film(**(point | {name: value + step})) - films.forced_film(
            **(point | {name: value - step})
        )
        assert gradient[name] == pytest.approx(float(change) / (2 * step), rel=1e-6), name


def test_gradients_exist_at_rest():
    gradient = jax.grad(lambda values: films.forced_film(**values))({"speed": 0.0, **FORCED})
    assert np.all(np.isfinite(list(gradient.values())))
    assert gradient["speed"] == 0.0
    assert gradient["natural"] == 1.0


def test_a_logged_film_is_what_was_logged():
    np.testing.assert_array_equal(films.logged_film(np.array([2.0, 40.0])), [2.0, 40.0])


def test_a_switched_film_is_off_on_or_on_for_a_share():
    np.testing.assert_allclose(films.switched_film(np.array([0.0, 0.25, 1.0]), 80.0), [0.0, 20.0, 80.0])
