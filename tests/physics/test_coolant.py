"""Coolant channels: limits in which the physics is plain, Gnielinski's numbers, both sides of the transition."""

import math

import jax
import numpy as np
import pytest

from tests.physics.points import WATER
from twin.physics import coolant
from twin.physics.laws import LAWS

CHANNEL = {"diameter": 0.01, "channel_length": 2.0, "area": math.pi * 0.01 * 2.0, "still": 1e-3, **WATER}
PR = 1.004e-6 * 998.2 * 4184.0 / 0.598  # 7.01


def flow(re: float) -> float:
    return re * math.pi * 0.01 * 1.004e-6 / 4


def test_slow_coolant_leaves_at_the_temperature_of_the_wall():
    """Heat is then rho c V (Twall - Tinlet), whatever the wall's coefficient."""
    for v in (flow(1.0), flow(10.0)):
        h = coolant.coolant_channel(v, **CHANNEL)
        assert (h - 1e-3) * CHANNEL["area"] == pytest.approx(998.2 * 4184.0 * v, rel=1e-3)


def test_fast_coolant_hardly_warms():
    """Heat is then h_wall A (Twall - Tinlet), less a half of NTU."""
    v = flow(2e5)
    nu = float(coolant.tube_turbulent(2e5, PR, 0.005))
    units = nu * 0.598 * math.pi * 2.0 / (998.2 * 4184.0 * v)
    assert units < 0.8
    h = coolant.coolant_channel(v, **CHANNEL)
    assert h == pytest.approx(nu * 0.598 / 0.01 * (1 - math.exp(-units)) / units, rel=1e-4)


def test_total_heat_does_not_depend_on_how_the_walls_are_meshed():
    v = flow(5e3)
    one, two = (float(coolant.coolant_channel(v, **(CHANNEL | {"area": a}))) - 1e-3 for a in (0.05, 0.1))
    assert one * 0.05 == pytest.approx(two * 0.1, rel=1e-12)


def test_at_rest_the_given_coefficient_remains():
    assert coolant.coolant_channel(0.0, **(CHANNEL | {"still": 5.0})) == 5.0
    assert coolant.coolant_channel(-flow(5e3), **CHANNEL) == coolant.coolant_channel(flow(5e3), **CHANNEL)
    gradient = jax.grad(coolant.coolant_channel)(0.0, **CHANNEL)
    assert np.isfinite(gradient)


def test_laminar_limits():
    """3.66 in a long tube; Leveque 1.615 (Re Pr d/L)^(1/3) in a short one."""
    assert coolant.tube_laminar(100.0, PR, 1e-7) == pytest.approx(3.66, rel=2e-3)
    graetz = 2000 * 1e3 * 1.0
    assert coolant.tube_laminar(2000.0, 1e3, 1.0) == pytest.approx(1.615 * graetz ** (1 / 3), rel=0.01)


def test_turbulent_by_hand():
    """Re = 1e5, Pr = 7: f = (1.8 * 5 - 1.5)^-2 = 0.0177778, Nu = 1555.6 / (1 + 0.59868 * 2.65931) = 600.19; Dittus and
    Boelter 0.023 * 1e4 * 7^0.4 = 501 is within their 20 %."""
    assert coolant.friction_factor(1e5) == pytest.approx(0.0177778, rel=1e-5)
    nu = coolant.tube_turbulent(1e5, 7.0, 0.0)
    assert nu == pytest.approx(600.19, rel=1e-3)
    assert nu == pytest.approx(0.023 * 1e4 * 7**0.4, rel=0.21)
    assert coolant.tube_turbulent(1e5, 7.0, 0.125) == pytest.approx(1.25 * float(nu), rel=1e-9)


def test_transition_is_linear_between_its_ends():
    low, high = float(coolant.tube_laminar(2300.0, PR, 0.005)), float(coolant.tube_turbulent(1e4, PR, 0.005))
    for re, nu in ((2300.0 - 1e-6, low), (2300.0 + 1e-6, low), (1e4 - 1e-6, high), (1e4 + 1e-6, high)):
        assert coolant.tube(re, PR, 0.005) == pytest.approx(nu, rel=1e-7)
    assert coolant.tube(6150.0, PR, 0.005) == pytest.approx((low + high) / 2, rel=1e-12)


def test_it_holds_up_to_its_flow_and_down_to_its_length():
    holds = coolant.coolant_channel_holds
    assert bool(holds(flow(5e3), **CHANNEL))
    assert bool(holds(0.0, **CHANNEL))
    assert not bool(holds(flow(2e6), **CHANNEL))
    assert not bool(holds(flow(5e3), **(CHANNEL | {"channel_length": 0.005})))


def test_it_does_not_radiate():
    assert not LAWS["coolant_channel"].radiates
