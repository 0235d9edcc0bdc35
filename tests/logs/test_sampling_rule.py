"""Table 16.1 of paper 001 with its example, and what averaging costs."""

from __future__ import annotations

import math

import pytest

from twin.logs.sampling_rule import AxisLimits, averaging_delay, averaging_gain, core_sampling, needed

EXAMPLE = AxisLimits("z", speed=1.0, acceleration=10.0, jerk=200.0, segment=0.02)


def test_the_papers_example():
    assert {n.quantity: n.interval for n in needed(EXAMPLE)} == pytest.approx(
        {"current": 5e-3, "speed": 10e-3, "position": 2e-3}
    )
    core = core_sampling([EXAMPLE])
    assert (core.interval, core.quantity) == (pytest.approx(2e-3), "position")
    assert str(core) == "2 ms (position of axis 'z')"


def test_the_fastest_axis_decides():
    slow = AxisLimits("x", speed=0.1, acceleration=1.0, jerk=5.0, segment=0.1)
    stiff = AxisLimits("y", acceleration=10.0, jerk=1000.0)
    assert str(core_sampling([slow, EXAMPLE, stiff])) == "1 ms (current of axis 'y')"


def test_what_is_not_known_is_not_asked_for():
    assert [n.quantity for n in needed(AxisLimits("x", speed=1.0, segment=0.05))] == ["position"]
    assert needed(AxisLimits("x", acceleration=10.0)) == ()
    assert core_sampling([AxisLimits("x", speed=1.0)]) is None
    assert core_sampling([]) is None


def test_averages_over_a_tenth_of_the_time_constant_serve():
    """[C] tau = 1794 s of the MAX ball screw: 179.4 s; 0.99958 at the corner, 0.959 at ten times it; 89.7 s late."""
    tau = 1794.0
    corner = 1.0 / (2.0 * math.pi * tau)
    assert averaging_gain(corner, tau / 10.0) == pytest.approx(0.99958, abs=5e-6)
    assert averaging_gain(10.0 * corner, tau / 10.0) == pytest.approx(0.959, abs=2e-4)
    assert averaging_delay(tau / 10.0) == pytest.approx(89.7)
    assert averaging_gain(0.0, 60.0) == 1.0
