"""Air against CoolProp's numbers and, outside its table, against Incropera's Table A.4."""

import jax
import numpy as np
import pytest

from twin.physics.air import air, in_table

COOLPROP = [  # degC, kg/m^3, J/(kg K), W/(m K), 1e-5 m^2/s, 1e-5 m^2/s, Pr
    (0, 1.2931, 1005.7, 0.02436, 1.3316, 1.8733, 0.7108),
    (20, 1.2046, 1006.1, 0.02587, 1.5114, 2.1348, 0.7080),
    (25, 1.1843, 1006.3, 0.02625, 1.5577, 2.2023, 0.7073),
    (40, 1.1274, 1006.9, 0.02735, 1.6999, 2.4095, 0.7055),
    (60, 1.0596, 1008.0, 0.02880, 1.8968, 2.6967, 0.7034),
    (80, 0.9995, 1009.5, 0.03023, 2.1019, 2.9957, 0.7017),
]


@pytest.mark.parametrize("row", COOLPROP)
def test_at_the_rows_of_the_table(row):
    t, density, heat_capacity, conductivity, viscosity, diffusivity, prandtl = row
    gas = air(float(t))
    assert gas.density == pytest.approx(density, rel=1e-9)
    assert gas.heat_capacity == pytest.approx(heat_capacity, rel=1e-9)
    assert gas.conductivity == pytest.approx(conductivity, rel=1e-9)
    assert gas.viscosity == pytest.approx(viscosity * 1e-5, rel=1e-9)
    assert gas.diffusivity == pytest.approx(diffusivity * 1e-5, rel=1e-9)
    assert gas.prandtl == pytest.approx(prandtl, rel=1e-4)
    assert gas.expansion == pytest.approx(1 / (t + 273.15), rel=1e-12)


def test_between_rows_it_is_the_ideal_gas_and_its_own_diffusivity():
    t = np.linspace(0.0, 80.0, 161)
    gas = air(t)
    np.testing.assert_allclose(gas.density, 101325 / (287.05 * (t + 273.15)), rtol=2e-3)
    np.testing.assert_allclose(gas.diffusivity, gas.conductivity / (gas.density * gas.heat_capacity), rtol=2.5e-3)


@pytest.mark.parametrize(
    ("kelvin", "viscosity", "conductivity", "diffusivity"), [(250, 11.44, 22.3, 15.9), (400, 26.41, 33.8, 38.3)]
)
def test_beyond_the_table(kelvin, viscosity, conductivity, diffusivity):
    """Incropera, Table A.4: linear extrapolation stays within 6 % to -40 and 150 degC."""
    gas = air(kelvin - 273.15)
    assert gas.viscosity == pytest.approx(viscosity * 1e-6, rel=0.06)
    assert gas.conductivity == pytest.approx(conductivity * 1e-3, rel=0.06)
    assert gas.diffusivity == pytest.approx(diffusivity * 1e-6, rel=0.06)
    assert gas.density == pytest.approx(101325 / (287.05 * kelvin), rel=0.06)
    for t in (-40.0, 150.0):
        assert air(t).density == pytest.approx(101325 / (287.05 * (t + 273.15)), rel=0.06)


def test_far_beyond_it_is_held_and_positive():
    assert air(-200.0).viscosity == air(-40.0).viscosity
    assert air(1000.0).viscosity == air(150.0).viscosity
    assert np.all(np.asarray(air(np.linspace(-270, 2000, 99))) > 0)
    assert np.isfinite(jax.grad(lambda t: air(t).expansion * air(t).viscosity)(-273.15))


def test_what_comes_from_the_table():
    np.testing.assert_array_equal(in_table(np.array([-0.1, 0.0, 40.0, 80.0, 80.1])), [False, True, True, True, False])
