"""Bolted joints against the numbers of paper 004."""

import math

import pytest

from tests.physics.points import BOLTS, JOINT
from twin.physics import joints
from twin.physics.laws import LAWS

SIGMA = math.sqrt(2.0) * 1.6e-6


def joint(**changed: float) -> dict[str, float]:
    row = LAWS["bolted_joint"]
    defaults = {name: argument.default for name, argument in row.parameters.items() if argument.default is not None}
    return defaults | JOINT | changed


def test_tightened_bolts_give_the_pressure():
    """Eq (10) with E-004-5: 4 x M12 at 80 N m: 41.26 kN each, 8.25 MPa on 0.02 m^2."""
    force = float(joints.bolt_force(80.0, 1.75e-3, 10.863e-3, 0.12, 13.5e-3, 16.6e-3))
    assert force == pytest.approx(41.26e3, abs=5.0)
    assert 4 * force / 0.02 == pytest.approx(8.25e6, abs=5e3)
    from_bolts = joints.bolted_joint(**joint(**BOLTS))
    assert from_bolts == pytest.approx(float(joints.bolted_joint(**joint(pressure=4 * force / 0.02))), rel=1e-9)
    # a given pressure wins
    assert joints.bolted_joint(**joint(pressure=5e6, **BOLTS)) == joints.bolted_joint(**joint(pressure=5e6))


def test_solid_part():
    """Eq (8): 15 507 W/(m^2 K). tan(theta) of the page is 0.151 sqrt(2) = 0.21355, printed as 0.2135."""
    h = joints.solid_conductance(50.0, 50.0, 1.6e-6, 1.6e-6, 0.151, 0.151, 5e6, 2.6e9)
    assert h == pytest.approx(15507.0, abs=1.0)


def test_gas_part():
    """Eq (9): lambda = 2.806 (exact 2.890), Y = 6.35 um, 3 899 W/(m^2 K)."""
    gap = float(joints.separation(5e6, 2.6e9))
    assert gap == pytest.approx(2.806, abs=5e-4)
    assert gap * SIGMA == pytest.approx(6.35e-6, abs=5e-9)
    assert joints.separation_exact(5e6, 2.6e9) == pytest.approx(2.890, abs=6e-4)
    assert joints.gas_conductance(0.0262, SIGMA, 0.37e-6, gap, 1.0) == pytest.approx(3899.0, abs=0.5)


def test_both_parts_add():
    both = float(joints.bolted_joint(**joint(pressure=5e6, factor=1.0, slope_1=0.151, slope_2=0.151)))
    assert both == pytest.approx(15507 + 3899, abs=1.5)


def test_gap_factor_on_both_sides_of_its_switch():
    """E-004-8. At B = sigma: 1.063 and 1.06."""
    assert joints.gap_factor(1e-6, 1e-6 * (1 - 1e-9), 3.0) == pytest.approx(1.063, abs=1e-6)
    assert joints.gap_factor(1e-6, 1e-6 * (1 + 1e-9), 3.0) == pytest.approx(1.06, abs=1e-6)
    # ln(10)^0.84 = 2.01506: 1.063 + 0.0471 * 1^1.68 * 2.01506
    assert joints.gap_factor(1e-6, 1e-7, 3.0) == pytest.approx(1.15791, abs=2e-5)
    assert joints.gap_factor(1e-6, 1e-5, 3.0) == pytest.approx(1 + 0.06 * 0.1**0.8, rel=1e-9)
    computed = float(joints.bolted_joint(**joint(pressure=5e6)))
    given = float(joints.bolted_joint(**joint(pressure=5e6, factor=1.0)))
    assert computed - given == pytest.approx(3899 * (float(joints.gap_factor(SIGMA, 0.37e-6, 2.80636)) - 1), rel=1e-3)


def test_rarefaction():
    """E-004-8: 2 gamma/(Pr (gamma + 1)) = 1.7 for air; full accommodation twice 1: 2 * 1.65 * 0.067 um."""
    assert joints.rarefaction(1.0, 1.0, 1.0, 1.4, 0.68) / 2 == pytest.approx(1.71, abs=0.01)
    assert joints.rarefaction(0.87, 0.87, 0.067e-6, 1.4, 0.68) == pytest.approx(0.298e-6, abs=2e-9)


def test_oil_in_the_gap_conducts_better():
    oiled = joint(pressure=5e6, gas_conductivity=0.14, rarefaction_length=0.0, factor=1.0)
    assert joints.bolted_joint(**oiled) > 1.5 * joints.bolted_joint(**joint(pressure=5e6))
    assert bool(joints.bolted_joint_holds(**oiled))


def test_without_pressure_and_bolts_there_is_no_joint():
    assert joints.bolted_joint(**joint()) == 0.0


def test_it_holds_within_its_pressures_and_gaps():
    assert bool(joints.bolted_joint_holds(**joint(**BOLTS)))
    assert not bool(joints.bolted_joint_holds(**joint(pressure=1e8)))  # p/H = 0.038
    assert not bool(joints.bolted_joint_holds(**joint(pressure=1e3)))  # p/H = 4e-7
    assert not bool(joints.bolted_joint_holds(**joint()))  # neither pressure nor bolts
    assert not bool(joints.bolted_joint_holds(**joint(pressure=5e6, rarefaction_length=1e-9)))
