"""Film laws: the printed coefficients, the side that is warm, rest, mixed flow, and where they stop to hold."""

import math

import jax
import numpy as np
import pytest

from twin.physics import forced_convection as forced
from twin.physics import free_convection as free
from twin.physics import nusselt_forced, nusselt_free
from twin.physics.air import air
from twin.physics.laws import LAWS


@pytest.mark.parametrize(
    ("height", "printed"),
    [(0.2, [2.03, 2.44, 2.72, 3.13, 3.79, 4.57]), (1.0, [1.59, 1.95, 2.21, 2.57, 3.17, 3.89])],
)
def test_vertical_plate_in_air_of_22_degrees(height, printed):
    """Paper 004, Fig. 3: 2.5 to 4.5 W/(m^2 K) over the difference of temperature."""
    difference = np.array([1.0, 2.0, 3.0, 5.0, 10.0, 20.0])
    h = np.asarray(free.free_vertical_plate(22.0 + difference, 22.0, height))
    np.testing.assert_allclose(h, printed, atol=0.0051)


@pytest.mark.parametrize(
    ("length", "printed"), [(0.035, (26.6, 36.4)), (0.1, (17.3, 24.1)), (0.2, (13.3, 18.8)), (0.5, (9.7, 14.0))]
)
def test_plate_at_70_and_120_m_per_min(length, printed):
    """Printed for air of 25 degC. Paper 004's 36 W/(m^2 K) needs a plate of 35 mm; its own length is lost."""
    for speed, h in zip((70 / 60, 120 / 60), printed, strict=True):
        assert forced.forced_plate(speed, 25.0, 25.0, length) == pytest.approx(h, abs=0.0505)
        assert forced.forced_plate(-speed, 25.0, 25.0, length) == forced.forced_plate(speed, 25.0, 25.0, length)


def test_coefficients_are_nusselt_numbers_of_the_film():
    """By hand at a film of 40 degC: surface 60, air 20, every property a row of the table."""
    nu, a, k, pr = 1.6999e-5, 2.4095e-5, 0.02735, 1.6999 / 2.4095
    ra = 9.80665 / 313.15 * 40.0 * 0.1**3 / (nu * a)
    assert free.free_flow(60.0, 20.0, 0.1).ra == pytest.approx(ra, rel=1e-7)
    f1 = (1 + (0.492 / pr) ** (9 / 16)) ** (-16 / 9)
    f2 = (1 + (0.322 / pr) ** (11 / 20)) ** (-20 / 11)
    f3 = (1 + (0.559 / pr) ** (9 / 16)) ** (-16 / 9)
    up, down = 0.15 * (ra * f2) ** (1 / 3), 0.6 * (ra * f1) ** 0.2
    side, cylinder = (0.825 + 0.387 * (ra * f1) ** (1 / 6)) ** 2, (0.6 + 0.387 * (ra * f3) ** (1 / 6)) ** 2
    expected = {
        free.free_horizontal_up: up, free.free_horizontal_down: down, free.free_vertical_plate: side,
        free.free_horizontal_cylinder: cylinder,
    }  # fmt: skip
    for law, number in expected.items():
        assert law(60.0, 20.0, 0.1) == pytest.approx(number * k / 0.1, rel=1e-6), law
    re = 2.0 * 0.1 / nu
    assert forced.reynolds(-2.0, 60.0, 20.0, 0.1) == pytest.approx(re, rel=1e-9)
    assert forced.rotational_reynolds(-10.0, 60.0, 20.0, 0.1) == pytest.approx(20 * math.pi * 0.1**2 / nu, rel=1e-9)
    assert forced.forced_bar(2.0, 60.0, 20.0, 0.1, 0.102, 0.675) == pytest.approx(
        0.102 * re**0.675 * pr ** (1 / 3) * k / 0.1, rel=1e-6
    )
    assert forced.rotating_cylinder(10.0, 60.0, 20.0, 0.1) == pytest.approx(
        0.133 * (20 * math.pi * 0.1**2 / nu) ** (2 / 3) * pr ** (1 / 3) * k / 0.1, rel=1e-6
    )
    assert forced.forced_cylinder(2.0, 60.0, 20.0, 0.1) == pytest.approx(
        (0.3 + 0.62 * re**0.5 * pr ** (1 / 3) / (1 + (0.4 / pr) ** (2 / 3)) ** 0.25
         * (1 + (re / 282000) ** 0.625) ** 0.8) * k / 0.1, rel=1e-6,
    )  # fmt: skip


@pytest.mark.parametrize("suffix", ["", "_incropera"])
def test_a_cold_surface_facing_up_works_as_a_hot_one_facing_down(suffix):
    up = LAWS[f"free_horizontal_up{suffix}"].function
    down = LAWS[f"free_horizontal_down{suffix}"].function
    hot_up, cold_up = up(surface=40.0, ambient=20.0, length=0.1), up(surface=20.0, ambient=40.0, length=0.1)
    assert cold_up == pytest.approx(float(down(surface=40.0, ambient=20.0, length=0.1)), rel=1e-12)
    assert hot_up == pytest.approx(float(down(surface=20.0, ambient=40.0, length=0.1)), rel=1e-12)
    assert hot_up > 1.3 * cold_up


def test_inclined_plate_knows_its_warm_side():
    """Upright it is a vertical plate; hot and facing up (or cold and facing down) the flow separates beyond Ra_c."""
    angle = math.radians(45)
    stable = free.free_inclined_plate(40.0, 20.0, 1.0, -angle)
    unstable = free.free_inclined_plate(40.0, 20.0, 1.0, angle)
    assert free.free_inclined_plate(20.0, 40.0, 1.0, -angle) == pytest.approx(float(unstable), rel=1e-12)
    assert free.free_inclined_plate(20.0, 40.0, 1.0, angle) == pytest.approx(float(stable), rel=1e-12)
    assert unstable > 1.15 * stable
    assert free.free_inclined_plate(24.0, 20.0, 0.3, 0.0) == pytest.approx(
        float(free.free_vertical_plate(24.0, 20.0, 0.3)), rel=1e-12
    )


def test_cylinders_and_box():
    thick = free.free_vertical_cylinder(40.0, 20.0, 1.0, 0.5)
    assert thick == pytest.approx(float(free.free_vertical_plate(40.0, 20.0, 0.5)), rel=1e-12)
    assert free.free_vertical_cylinder(40.0, 20.0, 0.01, 0.5) > 1.3 * thick
    faces = [
        (0.6, free.free_vertical_plate(40.0, 20.0, 0.5)),  # 2 (0.4 + 0.2) 0.5 m^2
        (0.08, free.free_horizontal_up(40.0, 20.0, 0.08 / 1.2)),
        (0.08, free.free_horizontal_down(40.0, 20.0, 0.08 / 1.2)),
    ]
    mean = sum(a * float(h) for a, h in faces) / 0.76
    for surface, ambient in ((40.0, 20.0), (20.0, 40.0)):  # warm or cold, one face works as each
        assert free.free_box(surface, ambient, 0.4, 0.2, 0.5) == pytest.approx(mean, rel=1e-12)


def test_mixed_flow_at_rest_is_free_and_fast_is_forced():
    still = forced.mixed_plate(0.0, 30.0, 20.0, 0.2, 0.5)
    assert still == pytest.approx(float(free.free_vertical_plate(30.0, 20.0, 0.5)), rel=1e-12)
    fast = forced.mixed_plate(2.0, 30.0, 20.0, 0.2, 0.5)
    alone = forced.forced_plate(2.0, 30.0, 20.0, 0.2)
    assert fast == pytest.approx((float(alone) ** 3 + float(still) ** 3) ** (1 / 3), rel=1e-6)
    shaft = forced.mixed_rotating_cylinder(0.0, 30.0, 20.0, 0.05)
    assert shaft == pytest.approx(float(free.free_horizontal_cylinder(30.0, 20.0, 0.05)), rel=1e-12)
    turning = forced.mixed_rotating_cylinder(30.0, 30.0, 20.0, 0.05)
    alone = forced.rotating_cylinder(30.0, 30.0, 20.0, 0.05)
    assert turning == pytest.approx((float(alone) ** 3 + float(shaft) ** 3) ** (1 / 3), rel=1e-6)
    speeds = np.linspace(0.0, 3.0, 400)  # never below the free value, and steadily up
    assert np.all(np.diff(np.asarray(forced.mixed_plate(speeds, 30.0, 20.0, 0.2, 0.5))) >= 0.0)


def test_two_axes_make_one_wind():
    """3 and 4 are 5; one axis alone is that of mixed_plate, and a standing machine has free convection."""

    def both(v: float, w: float) -> float:
        return float(forced.mixed_plate_two_axes(v, w, 30.0, 20.0, 0.2, 0.5))

    assert both(0.3, -0.4) == pytest.approx(float(forced.mixed_plate(0.5, 30.0, 20.0, 0.2, 0.5)), rel=1e-12)
    assert both(-0.6, 0.0) == pytest.approx(float(forced.mixed_plate(0.6, 30.0, 20.0, 0.2, 0.5)), rel=1e-12)
    assert both(0.0, 0.0) == pytest.approx(float(free.free_vertical_plate(30.0, 20.0, 0.5)), rel=1e-12)
    assert not bool(forced.mixed_plate_two_axes_holds(300.0, 300.0, 30.0, 20.0, 0.5, 1.0))


@pytest.mark.parametrize("way", ["up", "down"])
@pytest.mark.parametrize(("surface", "ambient"), [(40.0, 20.0), (20.0, 40.0)])
def test_mixed_flow_along_horizontal_surfaces(way, surface, ambient):
    """By hand at a film of 30 degC; warm or cold, the free part is that of the free law."""
    mixed, alone = LAWS[f"mixed_horizontal_{way}"].function, LAWS[f"free_horizontal_{way}"].function
    free_part = float(alone(surface, ambient, 0.1))
    still = mixed(0.0, surface, ambient, 0.3, 0.1)
    assert still == pytest.approx(free_part, rel=1e-12)
    speed = -0.3  # either part counts
    forced_part = float(forced.forced_plate(speed, surface, ambient, 0.3))
    assert 0.4 < forced_part / free_part < 3.0
    h = mixed(speed, surface, ambient, 0.3, 0.1)
    assert h == pytest.approx((forced_part**3 + free_part**3) ** (1 / 3), rel=1e-9)
    gas = air(30.0)
    pr = float(gas.prandtl)
    f1, f2 = (1 + (0.492 / pr) ** (9 / 16)) ** (-16 / 9), (1 + (0.322 / pr) ** (11 / 20)) ** (-20 / 11)
    ra = 9.80665 / 303.15 * 20.0 * 0.1**3 / float(gas.viscosity * gas.diffusivity)
    hot_up = (surface > ambient) == (way == "up")
    nu = 0.15 * (ra * f2) ** (1 / 3) if hot_up else 0.6 * (ra * f1) ** 0.2
    assert free_part == pytest.approx(nu * float(gas.conductivity) / 0.1, rel=1e-6)


def test_mixed_flow_across_a_cylinder():
    free_part = float(free.free_horizontal_cylinder(30.0, 20.0, 0.05))
    assert forced.mixed_cylinder(0.0, 30.0, 20.0, 0.05) == pytest.approx(free_part, rel=2e-3)
    forced_part = float(forced.forced_cylinder(0.2, 30.0, 20.0, 0.05))
    assert 0.4 < forced_part / free_part < 3.0
    for speed in (0.2, -0.2):
        h = forced.mixed_cylinder(speed, 30.0, 20.0, 0.05)
        assert h == pytest.approx((forced_part**3 + free_part**3) ** (1 / 3), rel=1e-9)


@pytest.mark.parametrize(
    ("law", "correlation", "sizes"),
    [
        (forced.forced_plate, nusselt_forced.plate, (0.1,)),
        (forced.forced_cylinder, nusselt_forced.cylinder, (0.1,)),
        (forced.forced_bar, lambda re, pr: nusselt_forced.bar(re, pr, 0.102, 0.675), (0.1, 0.102, 0.675)),
    ],
)
def test_forced_laws_are_their_correlation_down_to_the_end_of_its_range(law, correlation, sizes):
    gas = air(25.0)
    nu, k, pr = float(gas.viscosity), float(gas.conductivity), float(gas.prandtl)
    for re, counted in ((20.0, 20.0), (10.0, 10.0), (5.0, 10.0), (0.0, 10.0)):
        h = law(re * nu / 0.1, 30.0, 20.0, *sizes)
        assert h == pytest.approx(float(correlation(counted, pr)) * k / 0.1, rel=1e-9)
    gradient = jax.vmap(jax.grad(lambda v: law(v, 30.0, 20.0, *sizes)))(np.array([0.0, 10.0, 1e3]) * nu / 0.1)
    assert np.all(np.isfinite(gradient))
    assert gradient[0] == 0.0 < gradient[2]


def test_a_small_difference_does_not_matter():
    """The rounding at 0.01 K is below 1e-5 of the coefficient at 1 K."""
    gas = air(22.5)
    ra = 9.80665 * float(gas.expansion) * 1.0 * 0.2**3 / float(gas.viscosity * gas.diffusivity)
    exact = float(gas.conductivity) / 0.2 * float(nusselt_free.vertical_plate(ra, float(gas.prandtl)))
    assert free.free_vertical_plate(23.0, 22.0, 0.2) == pytest.approx(exact, rel=1.5e-5)


@pytest.mark.parametrize(
    ("law", "inside", "outside"),
    [
        ("free_vertical_plate", {"surface": 30.0, "ambient": 20.0, "height": 1.0}, {"height": 12.0}),
        ("free_vertical_plate", {"surface": 30.0, "ambient": 20.0, "height": 1.0}, {"surface": 150.0}),
        ("free_vertical_plate", {"surface": 30.0, "ambient": 20.0, "height": 1.0}, {"surface": -20.0, "ambient": -5.0}),
        ("free_vertical_plate_laminar", {"surface": 30.0, "ambient": 20.0, "height": 0.5}, {"height": 2.0}),
        ("free_inclined_plate", {"surface": 30.0, "ambient": 20.0, "length": 0.5, "angle": -0.5}, {"angle": -1.2}),
        ("free_inclined_plate", {"surface": 30.0, "ambient": 20.0, "length": 0.5, "angle": -0.5}, {"length": 2.0}),
        ("free_horizontal_up", {"surface": 10.0, "ambient": 20.0, "length": 0.1}, {"length": 0.01}),
        ("free_horizontal_up_incropera", {"surface": 30.0, "ambient": 20.0, "length": 0.1}, {"length": 0.01}),
        ("free_horizontal_down", {"surface": 30.0, "ambient": 20.0, "length": 0.1}, {"length": 0.01}),
        ("free_horizontal_down_incropera", {"surface": 30.0, "ambient": 20.0, "length": 0.5}, {"length": 3.0}),
        ("free_box", {"surface": 30.0, "ambient": 20.0, "length": 0.5, "width": 0.5, "height": 0.5}, {"width": 0.02}),
        ("forced_plate", {"speed": 1.0, "surface": 30.0, "ambient": 20.0, "length": 0.5}, {"speed": 0.0}),
        ("forced_plate", {"speed": 1.0, "surface": 30.0, "ambient": 20.0, "length": 0.5}, {"speed": -400.0}),
        ("forced_bar",
         {"speed": 2.0, "surface": 30.0, "ambient": 20.0, "height": 0.1, "constant": 0.1, "exponent": 0.7},
         {"speed": 0.1}),
        ("rotating_cylinder", {"speed": 20.0, "surface": 30.0, "ambient": 20.0, "diameter": 0.1}, {"speed": -150.0}),
        ("mixed_plate",
         {"speed": 0.0, "surface": 30.0, "ambient": 20.0, "length": 0.5, "height": 1.0}, {"speed": 350.0}),
        *((f"mixed_horizontal_{way}",
           {"speed": 0.0, "surface": 30.0, "ambient": 20.0, "length": 0.5, "area_over_perimeter": 0.1}, change)
          for way, change in (("up", {"speed": 350.0}), ("down", {"speed": 350.0}), ("down", {"surface": 150.0}),
                              ("down", {"area_over_perimeter": 0.01}))),
        ("mixed_horizontal_up",
         {"speed": 0.0, "surface": 10.0, "ambient": 20.0, "length": 0.5, "area_over_perimeter": 0.1},
         {"area_over_perimeter": 0.01}),
        ("mixed_cylinder", {"speed": 0.0, "surface": 30.0, "ambient": 20.0, "diameter": 0.1}, {"speed": -2000.0}),
        ("mixed_cylinder", {"speed": 0.0, "surface": 30.0, "ambient": 20.0, "diameter": 0.1}, {"diameter": 12.0}),
        ("mixed_rotating_cylinder",
         {"speed": 0.0, "surface": 30.0, "ambient": 20.0, "diameter": 0.1}, {"speed": 150.0}),
    ],
)  # fmt: skip
def test_where_laws_stop_to_hold(law, inside, outside):
    holds = LAWS[law].validity.holds
    assert bool(holds(**inside))
    assert not bool(holds(**(inside | outside)))


def test_a_machine_as_warm_as_its_air_is_not_flagged():
    """Rayleigh numbers go to zero there, and so does the heat."""
    for law, sizes in (
        ("free_vertical_plate", {"height": 0.5}),
        ("free_horizontal_down", {"length": 0.05}),
        ("free_box", {"length": 0.4, "width": 0.4, "height": 0.4}),
        ("mixed_plate", {"speed": 0.0, "length": 0.5, "height": 0.5}),
    ):
        assert bool(LAWS[law].validity.holds(surface=20.0, ambient=20.0, **sizes)), law


def test_an_assumed_gap_says_so():
    assert LAWS["enclosed_gap"].source.startswith("assumed")
    assert not LAWS["enclosed_gap"].radiates
    assert LAWS["enclosed_gap"].function(conductance=2.0) == 2.0
