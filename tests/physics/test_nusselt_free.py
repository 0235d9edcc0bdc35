"""Nusselt numbers of free convection: every tabulated number, and both sides of every switch."""

import math

import jax
import numpy as np
import pytest

from twin.physics import nusselt_free as nu

PR = 0.71
TABLE = [  # at Ra = 1e6, 1e8, 1e10
    (nu.vertical_plate, 16.5584, 61.0652, 252.2776),
    (nu.vertical_plate_laminar, 16.9419, 52.1045, None),
    (nu.horizontal_up, 11.0843, 51.4488, 238.8041),
    (nu.horizontal_up_incropera, 17.0763, 69.6238, 323.1652),
    (nu.horizontal_down, 7.6953, 19.3298, 48.5543),
    (nu.horizontal_down_incropera, 8.2414, 20.7016, None),
    (nu.horizontal_down_incropera_6, 8.5381, 27.0, 85.38),
    (nu.horizontal_cylinder, 14.5372, 56.5761, 240.6336),
]


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row[0].__name__)
def test_tabulated_numbers(row):
    for ra, number in zip((1e6, 1e8, 1e10), row[1:], strict=True):
        if number is not None:
            assert row[0](ra, PR) == pytest.approx(number, rel=1e-4)


def test_functions_of_prandtl():
    assert nu.f1(PR) == pytest.approx(0.347041, abs=5e-7)
    assert nu.f2(PR) == pytest.approx(0.403507, abs=5e-7)
    assert nu.f3(PR) == pytest.approx(0.327351, abs=5e-7)


def test_the_sign_of_f2():
    """With +20/11, as one public program has it, f2 would be above one and Nu of air 1.83 times too large."""
    assert nu.f2(PR) < 1.0
    wrong = (1 + (0.322 / PR) ** (11 / 20)) ** (20 / 11)
    assert 0.15 * (1e8 * wrong) ** (1 / 3) / float(nu.horizontal_up(1e8, PR)) == pytest.approx(1.83, abs=0.005)


def test_incroperas_printed_form_of_f1_is_the_same():
    for ra in (1e3, 1e6, 1e10):
        printed = (0.825 + 0.387 * ra ** (1 / 6) / (1 + (0.492 / PR) ** (9 / 16)) ** (8 / 27)) ** 2
        assert nu.vertical_plate(ra, PR) == pytest.approx(printed, rel=1e-12)


def test_horizontal_up_on_both_sides_of_its_switch():
    """At Ra f2 = 7e4, not at 7e-4: 0.766 * 7e4^(1/5) = 7.1326, 0.15 * 7e4^(1/3) = 6.1819."""
    switch = 7e4 / float(nu.f2(PR))
    assert nu.horizontal_up(switch * (1 - 1e-9), PR) == pytest.approx(7.1326, rel=1e-4)
    assert nu.horizontal_up(switch * (1 + 1e-9), PR) == pytest.approx(6.1819, rel=1e-4)
    assert nu.horizontal_up(1e3, PR) == pytest.approx(0.766 * (1e3 * 0.403507) ** 0.2, rel=1e-5)


def test_mcadams_on_both_sides_of_1e7():
    assert nu.horizontal_up_incropera(1e7 * (1 - 1e-9), PR) == pytest.approx(0.54 * 56.2341, rel=1e-5)
    assert nu.horizontal_up_incropera(1e7 * (1 + 1e-9), PR) == pytest.approx(0.15 * 215.4435, rel=1e-5)


def test_literature_differs_by_35_to_55_percent():
    for ra in (1e6, 1e8, 1e10):
        spread = float(nu.horizontal_up_incropera(ra, PR) / nu.horizontal_up(ra, PR)) - 1
        assert 0.34 < spread < 0.55


def test_inclined_plate():
    """F2 is F1 with cos(60 degrees) = 1/2; F3 beyond Ra_c, which is 10^8.9 upright."""
    assert nu.inclined_plate_stable(2e6, PR, math.radians(60)) == pytest.approx(16.5584, rel=1e-4)
    assert nu.transition_of_inclined_plate(0.0) == pytest.approx(10**8.9, rel=1e-12)
    assert nu.transition_of_inclined_plate(math.radians(-45)) == pytest.approx(
        10 ** (8.9 - 0.00178 * 45**1.82), rel=1e-12
    )


@pytest.mark.parametrize(("degrees", "below", "above"), [(0, 114.4398, 94.0170), (30, 59.7787, 55.0119)])
def test_inclined_plate_on_both_sides_of_the_transition(degrees, below, above):
    """Above: 0.56 (Ra_c cos)^(1/4). The published pair does not meet."""
    angle = math.radians(degrees)
    critical = 10 ** (8.9 - 0.00178 * degrees**1.82)
    assert 0.56 * (critical * math.cos(angle)) ** 0.25 == pytest.approx(above, rel=1e-4)
    assert nu.inclined_plate_unstable(critical * (1 + 1e-9), PR, angle) == pytest.approx(above, rel=1e-4)
    assert nu.inclined_plate_unstable(critical * (1 - 1e-9), PR, angle) == pytest.approx(
        (0.825 + 0.387 * (critical * math.cos(angle) * 0.347041) ** (1 / 6)) ** 2, rel=1e-5
    )
    assert nu.inclined_plate_unstable(critical * (1 - 1e-9), PR, angle) == pytest.approx(below, rel=1e-3)
    beyond = 0.56 * (critical * math.cos(angle)) ** 0.25 + 0.13 * (1e10 ** (1 / 3) - critical ** (1 / 3))
    assert nu.inclined_plate_unstable(1e10, PR, angle) == pytest.approx(beyond, rel=1e-9)


def test_vertical_cylinder_on_both_sides_of_its_switch():
    """Thick: the plate. At D/L = 35/Gr^(1/4): 1 + 0.29240 (32^(1/2)/35)^0.90899 = 1.05578."""
    gr = 1e8 / PR
    switch = gr**0.25 / 35
    assert nu.vertical_cylinder(1e8, PR, switch * (1 - 1e-9)) == pytest.approx(61.0652, rel=1e-4)
    assert nu.vertical_cylinder(1e8, PR, switch * (1 + 1e-9)) == pytest.approx(61.0652 * 1.05578, rel=1e-5)
    # ten times as slender: B (10 * 32^(1/2)/35)^C = 0.29240 * 1.54716
    assert nu.vertical_cylinder(1e8, PR, 10 * switch) == pytest.approx(61.0652 * 1.45239, rel=1e-4)


def test_alternatives_of_vdi():
    assert nu.vertical_cylinder_vdi(1e8, PR, 10.0) == pytest.approx(61.0652 + 4.35, rel=1e-4)
    assert nu.horizontal_cylinder_vdi(1e6, PR) == pytest.approx(
        (0.752 + 0.387 * (1e6 * 0.327351) ** (1 / 6)) ** 2, rel=1e-5
    )
    # the same cylinder: Ra and Nu of VDI's length are (pi/2)^3 and pi/2 times those of the diameter
    same = nu.horizontal_cylinder_vdi(1e8 * (math.pi / 2) ** 3, PR) / (math.pi / 2)
    assert same == pytest.approx(56.5761, rel=0.05)


@pytest.mark.parametrize("function", [row[0] for row in TABLE] + [nu.horizontal_cylinder_vdi])
def test_finite_gradient_without_a_difference(function):
    assert np.isfinite(jax.grad(function)(0.0, PR))
