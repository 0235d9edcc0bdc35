"""The rows of the table of laws that give heat [W]."""

from __future__ import annotations

from twin.physics import bearings, guides, heat, motors, screws, spindle
from twin.physics.law import Argument, Law, Validity

_ANY = -float("inf")
_CURRENT = {"current": Argument("A", "phase current, rms", low=_ANY)}
_AXIS_SPEED = {"speed": Argument("m/s", "axis speed", low=_ANY)}
_SHAFT_SPEED = {"speed": Argument("1/s", "speed of rotation", low=_ANY)}
_TORQUE = {"torque": Argument("N*m", "torque at the shaft", low=_ANY)}
_POWER = {"power": Argument("W", "electric power into the motor", low=_ANY)}
_WINDING_STATE = {"temperature": Argument("degC", "winding temperature: mean of the source's surface", low=-273.15)}
_BEARING_STATE = {"temperature": Argument("degC", "bearing temperature: mean of the source's surface", low=-273.15)}
_WINDING = {
    "resistance": Argument("ohm", "phase resistance at 20 degC (not line to line)"),
    "coefficient": Argument("1/K", "temperature coefficient of the resistance", motors.COPPER),
}
_IRON = {
    "hysteresis": Argument("W*s", "iron loss per speed", 0.0),
    "eddy": Argument("W*s^2", "iron loss per speed squared", 0.0),
}
_EXPONENT = {"exponent": Argument("1", "exponent of the speed", 1.0, 0.1, 5.0)}
_TURNING = {**_IRON, "friction_torque": Argument("N*m", "friction torque of bearings and seal", 0.0)}
_EFFICIENCY = {"efficiency": Argument("1", "efficiency of the motor", None, 1e-3, 1.0)}
_BEARING = {
    "f0": Argument("1", "lubrication factor f0r", 2.0),
    "viscosity": Argument("m^2/s", "kinematic viscosity of the lubricant", 12e-6),
    "diameter": Argument("m", "mean bearing diameter d_m"),
    "f1": Argument("1", "load factor f1r", 2.5e-4),
    "load": Argument("N", "load P1 in operation", 0.0),
}
_SCREW = {
    "force": Argument("N", "mean axial force; its size counts, as driven by the screw in both directions", low=_ANY),
    "preload": Argument("N", "preload of the nut", 0.0),
    "diameter": Argument("m", "pitch circle diameter", None, 1e-4),
    "lead": Argument("m", "lead", None, 1e-5),
    "friction": Argument("1", "friction coefficient of the ball contact", 0.005),
}
_COPPER_LINEAR = "winding -50 to 200 degC"

LOSSES: dict[str, Law] = {
    "motor_copper": Law(
        motors.motor_copper, "loss", "paper 000 eq (8) with erratum E-000-4",
        _CURRENT, {"resistance": Argument("ohm", "phase resistance")},
        formula="P = 3 R I^2",
    ),
    "motor_holding": Law(
        motors.motor_holding, "loss", "paper 000 eq (8) with erratum E-000-4; standstill losses: paper 000, 4",
        {**_CURRENT, **_AXIS_SPEED},
        {
            "resistance": Argument("ohm", "phase resistance"),
            "drag": Argument("N", "speed-proportional iron and bearing loss, per unit axis speed", 0.0),
        },
        formula="P = 3 R I^2 + F |v|",
    ),
    "motor_winding": Law(
        motors.motor_winding, "loss", "paper 004 eq (3) with erratum E-004-2",
        _CURRENT, _WINDING, _WINDING_STATE,
        "P = 3 R20 [1 + a (T - 20 degC)] I^2",
        Validity(motors.motor_winding_holds, _COPPER_LINEAR),
    ),
    "axis_motor": Law(
        motors.axis_motor, "loss", "paper 004 eq (3) with erratum E-004-2; iron losses: erratum E-002-8",
        {**_CURRENT, **_AXIS_SPEED},
        {**_WINDING, "lead": Argument("m", "axis travel per turn of the motor", None, 1e-6), **_TURNING},
        _WINDING_STATE,
        "P = 3 R20 [1 + a (T - 20 degC)] I^2 + k_h |n| + k_e n^2 + 2 pi |n| M_f, n = v / lead",
        Validity(motors.axis_motor_holds, _COPPER_LINEAR),
    ),
    "servo_motor": Law(
        motors.servo_motor, "loss", "paper 004 eq (3) with erratum E-004-2; iron losses: erratum E-002-8",
        {**_CURRENT, **_SHAFT_SPEED}, {**_WINDING, **_TURNING}, _WINDING_STATE,
        "P = 3 R20 [1 + a (T - 20 degC)] I^2 + k_h |n| + k_e n^2 + 2 pi |n| M_f",
        Validity(motors.servo_motor_holds, _COPPER_LINEAR),
    ),
    "motor_torque": Law(
        motors.motor_torque, "loss", "paper 002 eq (12) with erratum E-002-8",
        {**_TORQUE, **_SHAFT_SPEED},
        {**_WINDING, "torque_constant": Argument("N*m/A", "torque per rms phase current", None, 1e-9), **_IRON},
        _WINDING_STATE,
        "P = 3 R20 [1 + a (T - 20 degC)] (M / k_T)^2 + k_h |n| + k_e n^2",
        Validity(motors.motor_torque_holds, _COPPER_LINEAR),
    ),
    "motor_power": Law(
        motors.motor_power, "loss", "definition of efficiency; paper 002 eq (13)",
        _POWER, _EFFICIENCY,
        formula="P = P_el (1 - eta); fed back: |P_el| (1/eta - 1)",
    ),
    "motor_output": Law(
        motors.motor_output, "loss", "paper 002 eq (11) with erratum E-002-3",
        {**_TORQUE, **_SHAFT_SPEED}, _EFFICIENCY,
        formula="P = 2 pi n M (1/eta - 1); braking: 2 pi |n M| (1 - eta)",
    ),
    "linear_motor": Law(
        motors.linear_motor, "loss", "paper 004 eqs (3)-(5) with errata E-004-2 and E-004-4",
        {**_CURRENT, "force": Argument("N", "motor force", low=_ANY)},
        {
            **_WINDING,
            "cooling_max": Argument("W", "heat that all coolers take up at nominal force"),
            "nominal_force": Argument("N", "nominal force F_N", None, 1e-6),
        },
        _WINDING_STATE,
        "P = max(0, 3 R20 [1 + a (T - 20 degC)] I^2 - Q_Kmax (F / F_N)^2)",
        Validity(motors.linear_motor_holds, f"coolers take no more than the copper loss (clipped); {_COPPER_LINEAR}"),
    ),
    "guide_friction": Law(
        guides.guide_friction, "loss", "paper 004 eq (6)",
        _AXIS_SPEED,
        {
            "friction": Argument("1", "friction coefficient", 0.0015),
            "load": Argument("N", "normal load of all carriages"),
            "seal_drag": Argument("N", "drag of the seals", 0.0),
        },
        formula="P = (mu F_m + f_d) |v|",
    ),
    "guide_preload": Law(
        guides.guide_preload, "loss", "paper 002 eqs (1)-(3) with erratum E-002-6; seals: paper 004 eq (6)",
        _AXIS_SPEED,
        {
            "friction": Argument("1", "friction coefficient of roller guides", 4e-4),
            "dynamic_rating": Argument("N", "dynamic load rating C of a carriage"),
            "preload_class": Argument("1", "preload over dynamic rating", 0.13, 0.0, 0.5),
            "load": Argument("N", "load on a carriage", 0.0),
            "seal_drag": Argument("N", "drag of the seals of a carriage", 0.0),
            "carriages": Argument("1", "number of carriages", 1.0),
        },
        formula="P = N [mu (2 F_pr + F_load / 3) + f_d] |v|, F_pr = class C",
        validity=Validity(guides.guide_preload_holds, "F_load <= 3 F_pr"),
    ),
    "screw_friction": Law(
        screws.screw_friction, "loss", "paper 002 eqs (7)-(10) with errata E-002-2 and E-002-7",
        _AXIS_SPEED, _SCREW,
        formula="P = 2 pi n (M_d + M_pl), n = |v| / L, M_d = F L (1 - eta) / (2 pi eta), "
        "M_pl = F_p L (1 - eta^2) / (2 pi eta), eta = tan(phi) / tan(phi + rho)",
        validity=Validity(screws.screw_friction_holds, "0 < eta <= 1: mu L / (pi d) < 1"),
    ),
    "screw_back_driven": Law(
        screws.screw_back_driven, "loss", "paper 002 eqs (7)-(10) with erratum E-002-2",
        _AXIS_SPEED,
        {**_SCREW, "force": Argument("N", "mean axial force; its size counts, as driving the screw", low=_ANY)},
        formula="P = 2 pi n (M_d + M_pl), n = |v| / L, M_d = F L (1 - eta) / (2 pi), "
        "M_pl = F_p L (1 - eta^2) / (2 pi), eta = tan(phi) / tan(phi + rho)",
        validity=Validity(screws.screw_back_driven_holds, "L / (pi d) > mu: not self-locking; mu L / (pi d) < 1"),
    ),
    "bearing_friction": Law(
        bearings.bearing_friction, "loss", "paper 002 eqs (4)-(6), ISO 15312, with errata E-002-1, E-002-4 and E-002-5",
        _SHAFT_SPEED, _BEARING,
        formula="P = 2 pi n (M0 + M1), M0 = 1e-7 f0 (nu n)^(2/3) d_m^3, or 160e-7 f0 d_m^3 below "
        "nu n = 2000 mm^2/s 1/min [N mm, mm], M1 = f1 P1 d_m",
    ),
    "bearing_friction_warm": Law(
        bearings.bearing_friction_warm, "loss",
        "paper 002 eqs (4)-(6), ISO 15312, with errata E-002-1, E-002-4 and E-002-5; viscosity: ASTM D341",
        _SHAFT_SPEED,
        {
            "f0": _BEARING["f0"],
            "viscosity_40": Argument("m^2/s", "kinematic viscosity of the (base) oil at 40 degC", None, 2e-6),
            "viscosity_100": Argument("m^2/s", "kinematic viscosity of the (base) oil at 100 degC", None, 1e-6),
            "diameter": _BEARING["diameter"],
            "f1": _BEARING["f1"],
            "load": _BEARING["load"],
        },
        _BEARING_STATE,
        "as bearing_friction with nu(T): log log (nu + 0.7) = A - B log T",
        Validity(bearings.bearing_friction_warm_holds, "bearing -20 to 150 degC, viscosity_100 < viscosity_40"),
    ),
    "spindle": Law(
        spindle.spindle, "loss", "paper 002 eqs (4)-(6) and (11) with errata E-002-1, E-002-3 and E-002-4",
        {**_SHAFT_SPEED, "power": Argument("W", "cutting power", low=_ANY)},
        {
            **_BEARING,
            "bearings": Argument("1", "number of bearings", 2.0),
            "share": Argument("1", "share of the cutting power that stays as heat", None, 0.0, 1.0),
        },
        formula="P = N 2 pi n (M0 + M1) + s |P_cut|, M0 and M1 as in bearing_friction",
    ),
    "constant_heat": Law(
        heat.constant_heat, "loss", "given: electronics, pumps (paper 002, 2.2: a heated cabinet)",
        {}, {"power": Argument("W", "heat")},
        formula="P = constant",
    ),
    "switched_heat": Law(
        heat.switched_heat, "loss", "given: electronics, pumps (paper 002, 2.2: switched on at warm-up)",
        {"switch": Argument("1", "0 off, 1 on", low=0.0, high=1.0)}, {"power": Argument("W", "heat while on")},
        formula="P = switch P_on",
    ),
    "speed_heat": Law(
        heat.speed_heat, "loss", "assumed form; exponent 1: paper 004 eq (6)",
        _AXIS_SPEED,
        {
            "power": Argument("W", "heat at the reference speed"),
            "reference": Argument("m/s", "reference speed", None, 1e-9),
            **_EXPONENT,
        },
        formula="P = P_ref (|v| / v_ref)^m",
    ),
    "turning_heat": Law(
        heat.turning_heat, "loss", "assumed form; exponent 5/3: paper 002 eqs (4)-(6) without load",
        _SHAFT_SPEED,
        {
            "power": Argument("W", "heat at the reference speed"),
            "reference": Argument("1/s", "reference speed of rotation", None, 1e-9),
            **_EXPONENT,
        },
        formula="P = P_ref (|n| / n_ref)^m",
    ),
    "power_share": Law(
        heat.power_share, "loss", "definition",
        {"power": Argument("W", "logged power", low=_ANY)},
        {"share": Argument("1", "share of the power that stays as heat", None, 0.0, 1.0)},
        formula="P = s |P_logged|",
    ),
}  # fmt: skip
