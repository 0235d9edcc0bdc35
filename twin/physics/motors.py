"""Heat of motors [W]: copper, iron and friction. Arguments are numbers or arrays in SI units.

Currents are rms values of one phase, resistances those of one phase at 20 degC; whether a log holds rms or peak values
is declared with its signal (erratum E-000-4). Copper heats at standstill: a vertical axis warms at rest (paper 000).
"""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp

from twin.physics.grouped import Value, grouped

COPPER = 0.00393  # 1/K, at 20 degC


def motor_copper(current, resistance):
    """Copper loss of a three-phase motor: P = 3 R I^2.

    current [A] rms phase current, resistance [ohm] of one phase (not line to line, which would double the heat).
    Source: paper 000 eq (8) with erratum E-000-4: printed as R I^2 / A with neither rms or peak nor phase or line said,
    and resistance and area mixed in one parameter; here rms, phase, and the area is that of the surface.
    """
    return 3.0 * resistance * current**2


def motor_holding(current, speed, resistance, drag):
    """Copper loss plus a speed-proportional loss: P = 3 R I^2 + F |v|.

    drag F [N] collects iron and bearing losses per unit axis speed [m/s]. Source: paper 000 eq (8), erratum E-000-4.
    """
    return motor_copper(current, resistance) + drag * jnp.abs(speed)


def phase_resistance(temperature, resistance, coefficient):
    """Phase resistance [ohm] at a winding temperature [degC] from that at 20 degC: R20 (1 + a (T - 20)).

    Held at a tenth of R20, far below any machine's temperature. Source: paper 004 eq (3).
    """
    return resistance * jnp.maximum(1.0 + coefficient * (temperature - 20.0), 0.1)


def motor_winding(current, temperature, resistance, coefficient):
    """Copper loss at winding temperature: P = 3 R20 [1 + a (T - 20 degC)] I^2.

    current [A] rms, temperature T [degC] of the winding, resistance R20 [ohm] of a phase at 20 degC, coefficient a
    [1/K], copper 0.00393. From 20 to 120 degC the heat grows by 39 %.
    Source: paper 004 eq (3) with erratum E-004-2: printed with the "line resistance" and the rated temperature; it is
    the phase (strand) resistance at the actual temperature, which feeds back.
    """
    return motor_copper(current, phase_resistance(temperature, resistance, coefficient))


def winding_holds(temperature):
    """-50 to 200 degC, where the resistance of copper is linear in temperature."""
    return (temperature >= -50.0) & (temperature <= 200.0)


def motor_winding_holds(current, temperature, resistance, coefficient):
    """Winding temperature in the range of linear resistance."""
    return winding_holds(temperature)


def iron_loss(speed, hysteresis, eddy):
    """Iron loss: k_h |n| + k_e n^2; speed n [1/s], hysteresis k_h [W s], eddy k_e [W s^2]. Erratum E-002-8."""
    return hysteresis * jnp.abs(speed) + eddy * speed**2


def servo_motor(current, speed, temperature, resistance, coefficient, hysteresis, eddy, friction_torque):
    """Losses of a servo motor: P = 3 R(T) I^2 + k_h |n| + k_e n^2 + 2 pi |n| M_f.

    current [A] rms, speed n [1/s], temperature [degC] of the winding, resistance [ohm] of a phase at 20 degC,
    coefficient [1/K], hysteresis k_h [W s], eddy k_e [W s^2], friction_torque M_f [N m] of bearings and seal.
    Source: paper 004 eq (3); iron losses by n and n^2: erratum E-002-8 of paper 002 eq (12), which is printed as
    (T/xi)(n eps): that is current times back-EMF, the converted mechanical power, and zero at standstill.
    """
    copper = motor_winding(current, temperature, resistance, coefficient)
    return copper + iron_loss(speed, hysteresis, eddy) + 2.0 * jnp.pi * jnp.abs(speed) * friction_torque


def servo_motor_holds(current, speed, temperature, resistance, coefficient, hysteresis, eddy, friction_torque):
    """Winding temperature in the range of linear resistance."""
    return winding_holds(temperature)


@dataclass(frozen=True)
class Winding:
    """What the current of a motor flows through."""

    temperature: Value  # degC
    resistance: Value  # ohm, of a phase at 20 degC
    coefficient: Value  # 1/K


@dataclass(frozen=True)
class Turning:
    """What a motor loses by turning, and how far it moves its axis."""

    lead: Value  # m per revolution
    hysteresis: Value  # W s
    eddy: Value  # W s^2
    friction_torque: Value  # N m


@grouped
def axis_motor(current, speed, winding: Winding, turning: Turning):
    """Losses of the motor of a screw-driven axis, by axis speed: servo_motor at n = v / lead.

    speed v [m/s] of the axis, lead [m] of screw and gear together per motor revolution; the rest as servo_motor.
    """
    return servo_motor(
        current, speed / turning.lead, winding.temperature, winding.resistance, winding.coefficient,
        turning.hysteresis, turning.eddy, turning.friction_torque,
    )  # fmt: skip


@grouped
def axis_motor_holds(current, speed, winding: Winding, turning: Turning):
    """Winding temperature in the range of linear resistance."""
    return winding_holds(winding.temperature)


def motor_torque(torque, speed, temperature, resistance, coefficient, torque_constant, hysteresis, eddy):
    """Losses of a motor whose torque is logged: P = 3 R(T) (M/k_T)^2 + k_h |n| + k_e n^2.

    torque M [N m], speed n [1/s], torque_constant k_T [N m per A rms]; the rest as servo_motor.
    Source: paper 002 eq (12) with erratum E-002-8 (see servo_motor): 3 N m at 1.1 N m/A and 1.2 ohm heat with 26.8 W at
    standstill, where the printed form gives 0. k_T is taken as constant: no saturation.
    """
    copper = motor_winding(torque / torque_constant, temperature, resistance, coefficient)
    return copper + iron_loss(speed, hysteresis, eddy)


def motor_torque_holds(torque, speed, temperature, resistance, coefficient, torque_constant, hysteresis, eddy):
    """Winding temperature in the range of linear resistance."""
    return winding_holds(temperature)


def motor_power(power, efficiency):
    """Loss of a motor whose electric power is logged: P (1 - eta); fed back (P < 0): |P| (1/eta - 1).

    power P [W] into the motor, efficiency eta. Nothing at standstill, where P is all loss: use a law with the current
    for a vertical axis. Source: definition of efficiency; paper 002 eq (13) adds such losses up.
    """
    return jnp.where(power >= 0.0, power * (1.0 - efficiency), -power * (1.0 / efficiency - 1.0))


def motor_output(torque, speed, efficiency):
    """Loss of a motor by its output: 2 pi n M (1/eta - 1); braking (n M < 0): 2 pi |n M| (1 - eta).

    torque M [N m] at the shaft, speed n [1/s], efficiency eta. Source: paper 002 eq (11) with erratum E-002-3: printed
    as pi n M (1 - eta), half of the power, and with (1 - eta), which belongs to the input, on an output torque.
    """
    output = 2.0 * jnp.pi * speed * torque
    return jnp.where(output >= 0.0, output * (1.0 / efficiency - 1.0), -output * (1.0 - efficiency))


def _linear_motor(current, force, temperature, resistance, coefficient, cooling_max, nominal_force):
    copper = motor_winding(current, temperature, resistance, coefficient)
    return copper - cooling_max * (force / nominal_force) ** 2


def linear_motor(current, force, temperature, resistance, coefficient, cooling_max, nominal_force):
    """Heat of a linear motor into the structure: copper loss less that of its coolers, never below zero.

    Q = max(0, 3 R20 [1 + a (T - 20 degC)] I^2 - Q_Kmax (F/F_N)^2); current I [A] rms, force F [N], temperature T [degC]
    of the winding, cooling_max Q_Kmax [W] of all coolers together, nominal_force F_N [N].
    Source: paper 004 eqs (3)-(5) with errata E-004-2 (phase resistance, actual temperature) and E-004-4: eq (5) turns
    negative where the coolers are rated above the loss, which no cooler at its inlet temperature can do; there the heat
    is clipped and the step flagged. A coolant with flow and inlet temperature (coolant_channel) has no such limit.
    """
    rest = _linear_motor(current, force, temperature, resistance, coefficient, cooling_max, nominal_force)
    return jnp.maximum(rest, 0.0)


def linear_motor_holds(current, force, temperature, resistance, coefficient, cooling_max, nominal_force):
    """Not clipped, and the winding in the range of linear resistance."""
    rest = _linear_motor(current, force, temperature, resistance, coefficient, cooling_max, nominal_force)
    return (rest >= 0.0) & winding_holds(temperature)
