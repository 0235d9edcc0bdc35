"""Nusselt numbers of forced and mixed convection: every tabulated number, and both sides of every switch."""

import jax
import numpy as np
import pytest

from twin.physics import nusselt_forced as nu

PR = 0.71
TABLE = [  # at Re = 1e4, 1e5, 1e6
    (nu.plate_laminar, 59.2362, 187.3215, None),
    (nu.plate_turbulent, None, 311.8856, 1894.8963),
    (nu.plate, 78.7885, 363.8159, 1985.3275),
    (nu.plate_turbulent_incropera, None, None, 2082.6734),
    (nu.plate_mixed_incropera, None, None, 1305.6437),
    (nu.cylinder, 53.6304, 215.3461, 1233.7196),
    (nu.cylinder_hilpert, 51.0478, 255.1427, None),
]


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row[0].__name__)
def test_tabulated_numbers(row):
    for re, number in zip((1e4, 1e5, 1e6), row[1:], strict=True):
        if number is not None:
            assert row[0](re, PR) == pytest.approx(number, rel=1e-4)


def test_incroperas_mixed_form_is_guarded():
    """Printed, it is negative below Re = 2.9e5; laminar and mixed meet at 5e5."""
    assert 0.037 * 2.8e5**0.8 - 871 < 0 < 0.037 * 3.0e5**0.8 - 871
    re = np.array([0.0, 1e4, 1e5, 2.5e5, 4.9e5])
    np.testing.assert_allclose(nu.plate_mixed_incropera(re, PR), nu.plate_laminar(re, PR), rtol=1e-12)
    below, above = nu.plate_mixed_incropera(5e5 * (1 - 1e-9), PR), nu.plate_mixed_incropera(5e5 * (1 + 1e-9), PR)
    assert below == pytest.approx(0.664 * 707.1068 * 0.892112, rel=1e-4)
    assert above == pytest.approx((0.037 * 36238.98 - 871) * 0.892112, rel=1e-4)
    assert above == pytest.approx(float(below), rel=2e-3)


@pytest.mark.parametrize(
    ("re", "below", "above"),
    [
        (4.0, (0.989, 0.330), (0.911, 0.385)),
        (40.0, (0.911, 0.385), (0.683, 0.466)),
        (4e3, (0.683, 0.466), (0.193, 0.618)),
        (4e4, (0.193, 0.618), (0.027, 0.805)),
    ],
)
def test_hilpert_on_both_sides_of_each_switch(re, below, above):
    for factor, (c, m) in ((1 - 1e-9, below), (1 + 1e-9, above)):
        assert nu.cylinder_hilpert(re * factor, PR) == pytest.approx(c * re**m * PR ** (1 / 3), rel=1e-8)


def test_bars_have_jakobs_numbers():
    """Jakob's constants: a square, face on and edge on, and a hexagon at Re = 1e4."""
    for c, m, number in ((0.102, 0.675, 45.606), (0.246, 0.588, 49.357), (0.153, 0.638, 48.653)):
        assert nu.bar(1e4, PR, c, m) == pytest.approx(number, rel=1e-4)


def test_rotating_cylinder():
    """Becker at Re = 1e5: 0.133 * 2154.43 * 0.89211."""
    assert nu.rotating_cylinder(1e5, PR) == pytest.approx(0.133 * 2154.4347 * 0.892112, rel=1e-5)


def test_mixed_flow():
    assert nu.mixed(3.0, 4.0) == pytest.approx(91 ** (1 / 3), rel=1e-12)
    assert nu.mixed(3.0, 4.0, opposing=True) == pytest.approx(37 ** (1 / 3), rel=1e-12)
    assert nu.mixed(4.0, 3.0, opposing=True) == pytest.approx(37 ** (1 / 3), rel=1e-12)
    for free in (5.0, 50.0):  # alone, free flow is what it is, whichever way the other would blow
        assert nu.mixed(0.0, free) == pytest.approx(free, rel=1e-12)
        assert nu.mixed(0.0, free, opposing=True) == pytest.approx(free, rel=1e-12)


def test_gas_with_properties_of_the_ambient():
    assert nu.property_correction(20.0, 100.0) == pytest.approx((293.15 / 373.15) ** 0.12, rel=1e-12)
    assert nu.property_correction(20.0, 20.0) == 1.0


@pytest.mark.parametrize("function", [row[0] for row in TABLE] + [nu.rotating_cylinder])
def test_finite_and_never_negative_from_rest_on(function):
    re = np.concatenate([[0.0], np.logspace(-9, 7, 400)])
    assert np.all(np.asarray(function(re, PR)) >= 0.0)
    assert np.isfinite(jax.grad(function)(0.0, PR))


def test_finite_gradients_of_opposing_flows():
    assert np.all(np.isfinite(jax.grad(lambda x: nu.mixed(x[0], x[1], True))(np.array([3.0, 3.0]))))
    assert np.all(np.isfinite(jax.grad(lambda x: nu.mixed(x[0], x[1]))(np.array([0.0, 0.0]))))
