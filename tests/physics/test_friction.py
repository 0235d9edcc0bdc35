"""Guides, bearings, screws and spindle against the papers' numbers with their errata."""

import math

import numpy as np
import pytest

from tests.physics.points import BEARING, SCREW
from twin.physics import bearings, guides, heat, screws, spindle
from twin.physics.laws import LAWS


def test_guide_friction():
    """Paper 004 eq (6) at 70 m/min, both ways."""
    for speed in (70 / 60, -70 / 60):
        power = guides.guide_friction(speed=speed, friction=0.0015, load=5000.0, seal_drag=20.0)
        assert power == pytest.approx(32.08, abs=0.005)


def test_preload_rubs_without_load():
    """E-002-6: F_pr = 0.13 C. C = 50 kN: F = 2 * 6500 N; 4e-4 * 13 kN * 0.5 m/s = 2.6 W, where 0.13 F_load gives 0."""
    guide = {"friction": 4e-4, "dynamic_rating": 50e3, "preload_class": 0.13, "seal_drag": 0.0}
    assert guides.guide_preload(0.5, load=0.0, carriages=1.0, **guide) == pytest.approx(2.6, rel=1e-12)
    # eq (2): a third of the load more; four carriages
    assert guides.guide_preload(-0.5, load=3000.0, carriages=4.0, **guide) == pytest.approx(4 * 2.8, rel=1e-12)
    sealed = guides.guide_preload(0.5, load=0.0, carriages=2.0, **(guide | {"seal_drag": 10.0}))
    assert sealed == pytest.approx(2 * (2.6 + 5.0), rel=1e-12)


def test_preload_holds_until_a_row_lifts_off():
    guide = {"friction": 4e-4, "dynamic_rating": 50e3, "preload_class": 0.13, "seal_drag": 0.0, "carriages": 1.0}
    assert bool(guides.guide_preload_holds(0.5, load=19.4e3, **guide))
    assert not bool(guides.guide_preload_holds(0.5, load=19.6e3, **guide))


@pytest.mark.parametrize("speed", [0.2, -0.2])
@pytest.mark.parametrize("force", [500.0, -500.0])
def test_screw_friction_of_the_load(speed, force):
    """E-002-7: the loss of a driven screw is F v (1/eta - 1)."""
    power = float(screws.screw_friction(speed=speed, force=force, preload=0.0, **SCREW))
    assert power == pytest.approx(3.987, abs=5e-4)
    assert power == pytest.approx(500.0 * 0.2 * (1 / efficiency(SCREW["friction"]) - 1), rel=1e-12)


def efficiency(friction: float) -> float:
    """Paper 002 eq (10) for d = 25 mm, L = 10 mm."""
    phi = math.atan(10 / (math.pi * 25))
    assert math.degrees(phi) == pytest.approx(7.256, abs=5e-4)
    return math.tan(phi) / math.tan(phi + math.atan(friction))


def test_screw_efficiency():
    """0.9617 at 0.286 degrees, 0.9616 at 0.005 itself."""
    for friction, eta in ((SCREW["friction"], 0.96166), (0.005, 0.96160)):
        assert screws.screw_efficiency(0.025, 0.01, friction) == pytest.approx(eta, abs=5e-6)
        assert efficiency(friction) == pytest.approx(eta, abs=5e-6)


def test_driven_screw_power_balance():
    """E-002-7: the motor gives 2 pi n M = F v / eta; F v comes out, the rest is heat."""
    torque = 500.0 * 0.01 / (2 * math.pi * efficiency(SCREW["friction"]))
    into = 2 * math.pi * 20.0 * torque
    assert into - 500.0 * 0.2 == pytest.approx(float(screws.screw_friction(0.2, 500.0, 0.0, **SCREW)), rel=1e-12)


def test_back_driven_screw_power_balance():
    """The load gives F v, the motor brakes with 2 pi n M = F v eta, the rest is heat."""
    torque = 500.0 * 0.01 * efficiency(SCREW["friction"]) / (2 * math.pi)
    out = 2 * math.pi * 20.0 * torque
    assert 500.0 * 0.2 - out == pytest.approx(float(screws.screw_back_driven(-0.2, 500.0, 0.0, **SCREW)), rel=1e-12)


def test_screws_with_preload():
    """E-002-2: 2 pi n (M_d + M_pl) is 14.116 W as paper 002 writes the moments, back-driven; printed, 7.058 W."""
    assert screws.screw_back_driven(0.2, 500.0, 683.6, **SCREW) == pytest.approx(14.116, abs=1e-3)
    driven = float(screws.screw_friction(0.2, 500.0, 683.6, **SCREW))
    assert driven == pytest.approx(14.116 / efficiency(SCREW["friction"]), abs=1e-3)
    assert driven - float(screws.screw_friction(0.2, 0.0, 683.6, **SCREW)) == pytest.approx(3.987, abs=5e-4)


def test_self_locking_screws_are_flagged():
    assert bool(screws.screw_back_driven_holds(0.2, 500.0, 0.0, **SCREW))
    assert not bool(screws.screw_back_driven_holds(0.2, 500.0, 0.0, 0.025, 0.01, 0.2))


def test_screws_without_efficiency_are_flagged():
    """L = 2 pi d, tan(phi) = 2: from mu = 1 / 2 on no torque turns the screw, and the formula gives negative heat."""
    steep = {"speed": 0.2, "force": 500.0, "preload": 0.0, "diameter": 0.01, "lead": 0.02 * math.pi}
    holds = LAWS["screw_friction"].validity.holds
    for friction, inside in ((0.49, True), (0.51, False)):
        assert bool(holds(**steep, friction=friction)) == inside
        assert bool(screws.screw_back_driven_holds(**steep, friction=friction)) == inside
        assert (screws.screw_friction(**steep, friction=friction) > 0.0) == inside
        assert (0.0 < screws.screw_efficiency(0.01, 0.02 * math.pi, friction) <= 1.0) == inside
    assert bool(holds(0.2, 500.0, 0.0, **(SCREW | {"friction": 0.0})))


def test_bearing_friction():
    """E-002-1: 2 pi n, not pi n; M0 = 47.0998 N mm and M1 = 15.0 N mm at 3000 1/min."""
    assert bearings.bearing_friction(speed=50.0, load=1000.0, **BEARING) == pytest.approx(19.509, abs=5e-4)
    assert bearings.bearing_friction(speed=-50.0, load=1000.0, **BEARING) == pytest.approx(19.509, abs=5e-4)


def test_both_right_forms_of_bearing_power_agree():
    """2e-3 pi n[1/s] M and ISO 15312's pi n[1/min] M / (30 * 10^3), M in N mm; paper 002 prints half: 9.755 W."""
    moment = 47.0998 + 15.0
    law = float(bearings.bearing_friction(speed=50.0, load=1000.0, **BEARING))
    assert law == pytest.approx(2e-3 * math.pi * 50.0 * moment, rel=1e-5)
    assert law == pytest.approx(math.pi * 3000.0 * moment / 30e3, rel=1e-5)
    assert law / 2 == pytest.approx(9.755, abs=5e-4)


def bearing_torque(nu_n: float) -> float:
    """M0 [N mm] of the law, nu_n [mm^2/s 1/min]."""
    n = nu_n / 12.0 / 60.0
    return float(bearings.bearing_friction(speed=n, load=0.0, **BEARING)) / (2 * math.pi * n) * 1e3


def test_bearing_torque_on_both_sides_of_2000():
    """E-002-4: without load and speed the lubricant still drags; 2000^(2/3) = 158.7 meets 160."""
    assert bearing_torque(12.0 * 3000) == pytest.approx(47.0998, abs=5e-5)
    assert bearing_torque(1000.0) == pytest.approx(6.912, abs=5e-4)  # the form for high speeds would give 4.320
    assert bearing_torque(1.0) == pytest.approx(6.912, abs=5e-4)
    below, above = bearing_torque(2000.0 * (1 - 1e-9)), bearing_torque(2000.0 * (1 + 1e-9))
    assert above / below == pytest.approx(2000 ** (2 / 3) / 160, rel=1e-8)
    assert above == pytest.approx(below, rel=0.01)


def test_oil_thins_as_it_warms():
    """ISO VG 32 with 5.4 mm^2/s at 100 degC: the points given, 2e-3 between; 15.2 mm^2/s at 60 degC by ASTM D341."""
    nu = np.asarray(bearings.oil_viscosity(np.array([40.0, 100.0, 60.0, 20.0]), 32e-6, 5.4e-6)) * 1e6
    np.testing.assert_allclose(nu[:2], [32.0, 5.4], rtol=1e-12)
    a, b = (math.log10(math.log10(v + 0.7)) for v in (32.0, 5.4))
    x, y, z = (math.log10(t + 273.15) for t in (40.0, 100.0, 60.0))
    assert nu[2] == pytest.approx(10**10 ** (a + (b - a) * (z - x) / (y - x)) - 0.7, rel=1e-9)
    assert nu[2] == pytest.approx(15.2, abs=0.05)
    assert nu[3] > 2 * 32.0


def test_a_warm_bearing_runs_easier():
    bearing = {"f0": 2.0, "viscosity_40": 32e-6, "viscosity_100": 5.4e-6, "diameter": 0.06, "f1": 2.5e-4}
    cold, warm = (float(bearings.bearing_friction_warm(50.0, t, load=0.0, **bearing)) for t in (40.0, 100.0))
    assert cold == pytest.approx(float(bearings.bearing_friction(50.0, 2.0, 32e-6, 0.06, 2.5e-4, 0.0)), rel=1e-9)
    assert warm / cold == pytest.approx((5.4 / 32.0) ** (2 / 3), rel=1e-9)
    holds = bearings.bearing_friction_warm_holds
    assert bool(holds(50.0, 40.0, load=0.0, **bearing))
    assert not bool(holds(50.0, 160.0, load=0.0, **bearing))
    assert not bool(holds(50.0, 40.0, load=0.0, **(bearing | {"viscosity_40": 5e-6})))


def test_spindle_is_two_bearings_and_a_share_of_the_cut():
    values = {"f0": 2.0, "viscosity": 12e-6, "diameter": 0.06, "f1": 2.5e-4, "load": 1000.0, "bearings": 2.0}
    assert spindle.spindle(50.0, 0.0, share=0.1, **values) == pytest.approx(2 * 19.509, abs=1e-3)
    assert spindle.spindle(50.0, 5000.0, share=0.1, **values) == pytest.approx(500.0 + 2 * 19.509, abs=1e-3)


def test_given_heat():
    assert heat.constant_heat(150.0) == 150.0
    np.testing.assert_allclose(heat.switched_heat(np.array([0.0, 0.25, 1.0]), 150.0), [0.0, 37.5, 150.0])
    np.testing.assert_allclose(heat.power_share(np.array([-2000.0, 2000.0]), 0.1), 200.0)


@pytest.mark.parametrize("law", [heat.speed_heat, heat.turning_heat])
def test_heat_by_a_power_of_the_speed(law):
    """120 W at 2; at half of it 60, 30 and 120 / 2^(5/3) = 37.798 W by the exponent; either way, and none at rest."""
    assert law(2.0, 120.0, 2.0, 1.7) == pytest.approx(120.0)
    for exponent, expected in ((1.0, 60.0), (2.0, 30.0), (5.0 / 3.0, 37.7976)):
        np.testing.assert_allclose(law(np.array([1.0, -1.0, 0.0]), 120.0, 2.0, exponent), [expected, expected, 0.0],
                                   rtol=1e-5)  # fmt: skip
