"""A machine of 207 nodes with a mesh error that matters: an angle of two coarse boxes, heated at its corner."""

from __future__ import annotations

from pathlib import Path

CORNER = """
[machine]
name = "corner"
reference_temperature = "20 degC"

[materials.aluminium]
conductivity = "160 W/(m*K)"
density = "2700 kg/m^3"
heat_capacity = "900 J/(kg*K)"
youngs_modulus = "70 GPa"
poisson_ratio = 0.33
expansion = "23e-6 1/K"

[parts.base]
material = "aluminium"
adiabatic = ["z_min"]
box = { origin = [0.0, 0.0, 0.0], size = [0.2, 0.1, 0.05], divisions = [3, 2, 1] }

[parts.wall]
material = "aluminium"
box = { origin = [0.0, 0.0, 0.05], size = [0.05, 0.1, 0.15], divisions = [1, 2, 2] }

[parts.motor]
material = "aluminium"
box = { origin = [0.07, 0.025, 0.05], size = [0.03, 0.05, 0.04], divisions = [1, 1, 1] }

[contacts.wall]
kind = "fixed"
surfaces = ["base.z_max", "wall.z_min"]
conductance = "8000 W/(m^2*K)"

[contacts.motor]
kind = "fixed"
surfaces = ["base.z_max", "motor.z_min"]
conductance = "5000 W/(m^2*K)"

[signals.current]
unit = "A"
kind = "rms"
range = [0.0, 12.0]

[signals.air]
unit = "degC"
range = [10.0, 35.0]

[environment.shop]
signal = "air"

[sources.motor]
law = "motor_copper"
surface = "motor.z_max"
parameters = { resistance = "0.5 ohm" }
signals = { current = "current" }

[films.all]
law = "constant_film"
emissivity = 0.0
surfaces = ["base.*", "wall.*", "motor.*"]
environment = "shop"
parameters = { natural = "30 W/(m^2*K)" }

[sensors.beside]
part = "base"
position = [0.11, 0.03, 0.05]

[sensors.seat]
part = "base"
position = [0.085, 0.05, 0.03]

[sensors.wall]
part = "wall"
position = [0.05, 0.05, 0.06]

[tcp.tool]
surface = "wall.z_max"
point = [0.025, 0.05, 0.2]

[tcp.work]
surface = "base.x_max"

[supports.left]
surface = "base.x_min"
stiffness = ["50 N/um", "50 N/um", "200 N/um"]

[supports.right]
surface = "base.x_max"
stiffness = ["50 N/um", "50 N/um", "200 N/um"]

[supports.front]
surface = "base.y_min"
stiffness = ["50 N/um", "50 N/um", "200 N/um"]
"""


def corner(folder: Path) -> Path:
    """Its description, written into `folder`."""
    path = folder / "machine.toml"
    path.write_text(CORNER, encoding="utf-8")
    return path
