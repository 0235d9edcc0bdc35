"""Motors against the papers' numbers, and the way of a logged current to heat."""

import math
from dataclasses import replace

import numpy as np
import pytest
import synthetic

from tests.physics.points import IRON, WINDING
from twin.logs.run import Run, Table
from twin.logs.signals import signal_values
from twin.physics import motors
from twin.physics.laws import LAWS
from twin.rom.drive import evaluate


def test_copper():
    """Erratum E-000-4; paper 004 eq (3) at 20 degC."""
    assert motors.motor_copper(current=10.0, resistance=1.5) == pytest.approx(450.0, rel=1e-14)
    assert motors.motor_copper(current=-10.0, resistance=1.5) == pytest.approx(450.0, rel=1e-14)


@pytest.mark.parametrize(("temperature", "heat"), [(20.0, 450.0), (120.0, 626.85)])
def test_winding(temperature, heat):
    """Paper 004 eq (3), R = 1.5 ohm, I = 10 A."""
    assert motors.motor_winding(10.0, temperature, 1.5, 0.00393) == pytest.approx(heat, abs=0.005)


def test_line_to_line_resistance_taken_for_a_phase_doubles_the_heat():
    """E-004-2: of a star, two phases in series lie between two lines."""
    phase = motors.motor_winding(10.0, 20.0, 1.5, 0.00393)
    assert motors.motor_winding(10.0, 20.0, 2 * 1.5, 0.00393) == pytest.approx(2 * float(phase), rel=1e-14)


def test_holding_heats_at_standstill():
    """A vertical axis heats at rest (paper 000, 4), which paper 002 eq (12) misses (E-002-8)."""
    at_rest = motors.motor_holding(current=3.0 / 1.1, speed=0.0, resistance=1.2, drag=30.0)
    assert at_rest == pytest.approx(26.8, abs=0.05)
    moving = motors.motor_holding(current=3.0 / 1.1, speed=-0.5, resistance=1.2, drag=30.0)
    assert moving - at_rest == pytest.approx(15.0, rel=1e-12)


def test_torque_heats_at_standstill():
    """E-002-8: 3 N m, 1.1 N m/A, 1.2 ohm: 26.8 W where the printed back-EMF power (M/k) n U is zero."""
    parameters = {"resistance": 1.2, "coefficient": 0.00393, "torque_constant": 1.1, "hysteresis": 0.0, "eddy": 0.0}
    for torque in (3.0, -3.0):
        heat = motors.motor_torque(torque, 0.0, 20.0, **parameters)
        assert heat == pytest.approx(26.8, abs=0.05)
    assert motors.motor_torque(0.0, 0.0, 20.0, **parameters) == 0.0


@pytest.mark.parametrize("name", ["axis_motor", "servo_motor", "motor_winding"])
def test_current_at_zero_speed_heats(name):
    law = LAWS[name]
    values = {"current": 7.0, "speed": 0.0, "lead": 0.02, "friction_torque": 0.3, **WINDING, **IRON}
    heat = law.function(**{k: v for k, v in values.items() if k in {**law.signals, **law.states, **law.parameters}})
    assert heat == pytest.approx(3 * 0.8 * (1 + 0.00393 * 60) * 49, rel=1e-12)


def test_iron_and_friction():
    """15 1/s: 0.7 W s * 15 + 0.02 W s^2 * 225 = 15 W; 2 pi 15 * 0.3 N m = 28.27 W; 0.3 m/s on 20 mm is 15 1/s."""
    parameters = {**WINDING, **IRON, "friction_torque": 0.3}
    for sign in (1.0, -1.0):
        servo = motors.servo_motor(0.0, sign * 15.0, **parameters)
        assert servo == pytest.approx(15.0 + 28.2743, abs=1e-4)
        assert motors.axis_motor(0.0, sign * 0.3, lead=0.02, **parameters) == pytest.approx(float(servo), rel=1e-12)


def test_losses_by_efficiency_balance():
    """In = out + loss, motoring and braking. E-002-3: M = 20 N m out, 10 1/s, eta = 0.8."""
    out = 2 * math.pi * 10 * 20
    loss = float(motors.motor_output(20.0, 10.0, 0.8))
    assert loss == pytest.approx(314.159, abs=1e-3)
    assert loss == pytest.approx(2 * math.pi * 10 * 20 * 0.25, rel=1e-12)  # printed: pi n M (1 - eta), 125.7 W
    assert motors.motor_power(out + loss, 0.8) == pytest.approx(loss, rel=1e-12)
    braking = float(motors.motor_output(20.0, -10.0, 0.8))
    assert braking == pytest.approx(0.2 * out, rel=1e-12)
    assert motors.motor_power(-(out - braking), 0.8) == pytest.approx(braking, rel=1e-12)


def test_linear_motor_and_its_coolers():
    """Paper 004 eqs (3)-(5): 626.85 W at 120 degC, less 800 W (1000/2000)^2."""
    motor = {"resistance": 1.5, "coefficient": 0.00393, "nominal_force": 2000.0}
    heat = motors.linear_motor(10.0, 1000.0, 120.0, cooling_max=800.0, **motor)
    assert heat == pytest.approx(426.85, abs=0.005)
    assert bool(motors.linear_motor_holds(10.0, 1000.0, 120.0, cooling_max=800.0, **motor))


def test_a_linear_motor_does_not_cool_the_machine():
    """E-004-4: eq (5) would give 450 - 800 = -350 W; clipped, and flagged."""
    motor = {"resistance": 1.5, "coefficient": 0.00393, "cooling_max": 800.0, "nominal_force": 2000.0}
    assert motors.linear_motor(10.0, 2000.0, 20.0, **motor) == 0.0
    assert not bool(motors.linear_motor_holds(10.0, 2000.0, 20.0, **motor))
    assert bool(motors.linear_motor_holds(0.0, 0.0, 20.0, **motor))


@pytest.mark.parametrize("temperature", [-60.0, 210.0])
def test_a_winding_out_of_range_is_flagged(temperature):
    assert not bool(LAWS["motor_winding"].validity.holds(10.0, temperature, 1.5, 0.00393))


def heat_of(kind: str, logged: np.ndarray) -> np.ndarray:
    """Mean power (n_steps,) [W] of the x motor (0.4 ohm) for a logged current, its signal declared as `kind`."""
    load = synthetic.load_model()
    signals = tuple(replace(s, kind=kind) if s.name == "x_current" else s for s in load.signals)
    load = replace(load, signals=signals)
    time = np.arange(len(logged), dtype=float)
    columns = {s.column: np.full(len(time), 20.0 if s.unit == "degC" else 0.0) for s in signals}
    run = Run(Table(time, columns | {"x_current": logged}, {s.column: s.unit for s in signals}))
    return evaluate(load, time, signal_values(run, signals), 60.0, n_steps=len(logged) // 60).power[:, 0]


def test_the_same_machine_described_in_rms_and_in_peak_heats_alike():
    """E-000-4: the factor 1/sqrt(2) is a property of the signal, the law sees rms."""
    current = np.repeat([0.0, 3.0, 12.0, 7.0], 60)
    in_rms, in_peak = heat_of("rms", current), heat_of("peak", math.sqrt(2.0) * current)
    np.testing.assert_allclose(in_peak, in_rms, rtol=1e-14)
    np.testing.assert_allclose(in_rms, 3 * 0.4 * current[::60] ** 2, rtol=1e-14)


def test_powers_are_averaged_not_currents():
    """E-001-4: 20 % duty at 10 A has a mean square of 20 A^2; the mean squared is 4 A^2."""
    current = np.where(np.arange(600) % 10 < 2, 10.0, 0.0)
    np.testing.assert_allclose(heat_of("rms", current), 3 * 0.4 * 20.0, rtol=1e-13)
