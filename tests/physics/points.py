"""One point of operation per law: no zeros, no switches, inside its range."""

from __future__ import annotations

import math

# mu = 0.005 is a friction angle of 0.286 degrees; the figures of the errata were worked out with that rounded angle
SCREW = {"diameter": 0.025, "lead": 0.01, "friction": math.tan(math.radians(0.286))}
BEARING = {"f0": 2.0, "viscosity": 12e-6, "diameter": 0.060, "f1": 2.5e-4}
WINDING = {"temperature": 80.0, "resistance": 0.8, "coefficient": 0.00393}
IRON = {"hysteresis": 0.7, "eddy": 0.02}
TEMPERATURES = {"surface": 35.0, "ambient": 22.0}
JOINT = {
    "conductivity_1": 50.0,
    "conductivity_2": 50.0,
    "roughness_1": 1.6e-6,
    "roughness_2": 1.6e-6,
    "slope_1": 0.2135 / math.sqrt(2.0),
    "slope_2": 0.2135 / math.sqrt(2.0),
    "hardness": 2.6e9,
    "gas_conductivity": 0.0262,
    "rarefaction_length": 0.37e-6,
}
BOLTS = {  # 4 x M12
    "bolts": 4.0,
    "torque": 80.0,
    "pitch": 1.75e-3,
    "flank_diameter": 10.863e-3,
    "bolt_friction": 0.12,
    "hole_diameter": 13.5e-3,
    "head_diameter": 16.6e-3,
    "area": 0.02,
}
WATER = {"density": 998.2, "heat_capacity": 4184.0, "conductivity": 0.598, "viscosity": 1.004e-6}

LOSSES = {
    "motor_copper": {"current": 7.0, "resistance": 0.8},
    "motor_holding": {"current": 7.0, "speed": -0.3, "resistance": 0.8, "drag": 30.0},
    "motor_winding": {"current": 7.0, **WINDING},
    "axis_motor": {"current": 7.0, "speed": -0.3, "lead": 0.02, "friction_torque": 0.3, **WINDING, **IRON},
    "servo_motor": {"current": 7.0, "speed": -15.0, "friction_torque": 0.3, **WINDING, **IRON},
    "motor_torque": {"torque": -3.0, "speed": 15.0, "torque_constant": 1.1, **WINDING, **IRON},
    "motor_power": {"power": 4000.0, "efficiency": 0.9},
    "motor_output": {"torque": 20.0, "speed": 15.0, "efficiency": 0.9},
    "linear_motor": {"current": 7.0, "force": 1500.0, "cooling_max": 90.0, "nominal_force": 2000.0, **WINDING},
    "guide_friction": {"speed": -0.3, "friction": 0.0015, "load": 5000.0, "seal_drag": 20.0},
    "guide_preload": {
        "speed": -0.3, "friction": 4e-4, "dynamic_rating": 5e4, "preload_class": 0.13, "load": 4000.0,
        "seal_drag": 10.0, "carriages": 4.0,
    },
    "screw_friction": {"speed": -0.2, "force": -500.0, "preload": 683.6, **SCREW},
    "screw_back_driven": {"speed": -0.2, "force": -500.0, "preload": 683.6, **SCREW},
    "bearing_friction": {"speed": 50.0, "load": 1000.0, **BEARING},
    "bearing_friction_warm": {
        "speed": 50.0, "temperature": 55.0, "f0": 2.0, "viscosity_40": 32e-6, "viscosity_100": 5.4e-6,
        "diameter": 0.06, "f1": 2.5e-4, "load": 1000.0,
    },
    "spindle": {"speed": 100.0, "power": 5000.0, "load": 500.0, "bearings": 2.0, "share": 0.1, **BEARING},
    "constant_heat": {"power": 150.0},
    "switched_heat": {"switch": 0.5, "power": 150.0},
    "speed_heat": {"speed": -0.3, "power": 150.0, "reference": 0.5, "exponent": 1.5},
    "turning_heat": {"speed": -30.0, "power": 150.0, "reference": 100.0, "exponent": 1.7},
    "power_share": {"power": 5000.0, "share": 0.1},
}  # fmt: skip
FILMS = {
    "constant_film": {"natural": 6.0},
    "forced_film": {"speed": -0.3, "natural": 6.0, "forced": 20.0, "exponent": 0.8},
    "free_vertical_plate": {"height": 0.4, **TEMPERATURES},
    "free_vertical_plate_laminar": {"height": 0.4, **TEMPERATURES},
    "free_inclined_plate": {"length": 0.4, "angle": -0.5, **TEMPERATURES},
    "free_horizontal_up": {"length": 0.1, **TEMPERATURES},
    "free_horizontal_down": {"length": 0.1, **TEMPERATURES},
    "free_horizontal_up_incropera": {"length": 0.1, **TEMPERATURES},
    "free_horizontal_down_incropera": {"length": 0.1, **TEMPERATURES},
    "free_horizontal_cylinder": {"diameter": 0.05, **TEMPERATURES},
    "free_vertical_cylinder": {"diameter": 0.05, "height": 0.6, **TEMPERATURES},
    "free_box": {"length": 0.6, "width": 0.4, "height": 0.5, **TEMPERATURES},
    "forced_plate": {"speed": -0.6, "length": 0.3, **TEMPERATURES},
    "forced_cylinder": {"speed": -0.6, "diameter": 0.05, **TEMPERATURES},
    "forced_bar": {"speed": -1.6, "height": 0.1, "constant": 0.102, "exponent": 0.675, **TEMPERATURES},
    "rotating_cylinder": {"speed": -20.0, "diameter": 0.05, **TEMPERATURES},
    "mixed_plate": {"speed": -0.6, "length": 0.3, "height": 0.5, **TEMPERATURES},
    "mixed_plate_two_axes": {"speed": -0.6, "speed_across": 0.3, "length": 0.3, "height": 0.5, **TEMPERATURES},
    "mixed_horizontal_up": {"speed": -0.6, "length": 0.3, "area_over_perimeter": 0.1, **TEMPERATURES},
    "mixed_horizontal_down": {"speed": -0.6, "length": 0.3, "area_over_perimeter": 0.1, **TEMPERATURES},
    "mixed_cylinder": {"speed": -0.6, "diameter": 0.05, **TEMPERATURES},
    "mixed_rotating_cylinder": {"speed": -5.0, "diameter": 0.05, **TEMPERATURES},
    "logged_film": {"coefficient": 6.0},
    "switched_film": {"switch": 0.5, "natural": 6.0},
    "enclosed_gap": {"conductance": 2.0},
    "coolant_channel": {"flow": 5e-5, "diameter": 0.01, "channel_length": 2.0, "area": 0.06, "still": 1.0, **WATER},
}
JOINTS = {"bolted_joint": {"pressure": 5e6, "factor": 1.2, **JOINT, **BOLTS}}
POINTS = {**LOSSES, **FILMS, **JOINTS}
# what stands still or is at the temperature of the air
REST = {
    "speed": 0.0,
    "speed_across": 0.0,
    "current": 0.0,
    "force": 0.0,
    "torque": 0.0,
    "flow": 0.0,
    "switch": 0.0,
    "surface": 22.0,
}
