"""A small machine of parts, and a probe holder at the wall that nobody described: loads are those of `planted`."""

from __future__ import annotations

from tests.calibrate.members import planted

TEXT = """
[machine]
name = "small_box"
reference_temperature = "20 degC"

[materials.cast_iron]
conductivity = "50 W/(m*K)"
density = "7200 kg/m^3"
heat_capacity = "500 J/(kg*K)"
youngs_modulus = "120 GPa"
poisson_ratio = 0.26
expansion = "10e-6 1/K"

[parts.column]
material = "cast_iron"
adiabatic = ["z_min"]
box = { origin = [0.0, 0.0, 0.0], size = [0.15, 0.15, 0.4], divisions = [1, 1, 3] }

[signals.speed]
unit = "1/min"
range = [0.0, "6000 1/min"]

[signals.air]
unit = "degC"
range = [0.0, 50.0]

[environment.air]
signal = "air"

[sources.friction]
law = "turning_heat"
surface = "column.z_max"
parameters = { power = "30 W", reference = "5000 1/min", exponent = 1.67 }
signals = { speed = "speed" }

[films.all]
law = "constant_film"
surfaces = ["column.*"]
environment = "air"
emissivity = 0.0
parameters = { natural = "10 W/(m^2*K)" }

[sensors.top]
part = "column"
position = [0.075, 0.075, 0.38]

[sensors.foot]
part = "column"
position = [0.075, 0.075, 0.05]

[supports.floor]
surface = "column.z_min"
stiffness = ["200 N/um", "200 N/um", "200 N/um"]

[supports.side] # three points off one line hold what stands on springs
surface = "column.x_min"
stiffness = ["20 N/um", "20 N/um", "20 N/um"]

[supports.back]
surface = "column.y_min"
stiffness = ["20 N/um", "20 N/um", "20 N/um"]

[tcp.tool]
surface = "column.z_max"
point = [0.075, 0.075, 0.45]

[tcp.work]
surface = "column.z_min"
"""
# the body that `planted` has at the wall, under another name
HIDDEN = f"{planted.HIDDEN}\n[tcp.expansion]\n{planted.MOVES}".replace("column", "holder")


def hidden() -> str:
    """The real machine: other parameters within tolerance, and the holder."""
    text = TEXT.replace('"30 W"', '"33 W"').replace('natural = "10 W', 'natural = "11 W')
    return text.rstrip() + "\n" + HIDDEN
