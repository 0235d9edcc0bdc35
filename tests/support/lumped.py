"""Small lumped machines as text, and the lumped machine of the tests with edits."""

from __future__ import annotations

from pathlib import Path

SPINDLE = Path(__file__).parents[1] / "machines" / "spindle"

HEAD = """
[machine]
name = "small"
reference_temperature = "20 degC"

[materials.steel]
conductivity = "50 W/(m*K)"
density = "7800 kg/m^3"
heat_capacity = "500 J/(kg*K)"
expansion = "12e-6 1/K"

[signals.current]
unit = "A"
kind = "rms"
range = [0, 100]

[environment.air]
temperature = "20 degC"
"""


def film(name: str, surfaces: str, coefficient: float, environment: str = "air", more: str = "") -> str:
    """A film of convection alone, constant."""
    return f"""
[films.{name}]
law = "constant_film"
surfaces = [{", ".join(repr(s) for s in surfaces.split())}]
environment = "{environment}"
emissivity = 0.0
parameters = {{ natural = {coefficient} }}
{more}
"""


def source(name: str, place: str) -> str:
    """A loss of I^2 [W] of the signal `current`."""
    return f"""
[sources.{name}]
law = "motor_copper"
surface = "{place}"
parameters = {{ resistance = {1 / 3} }}
signals = {{ current = "current" }}
"""


def write(folder: Path, *texts: str, head: str = HEAD) -> Path:
    path = folder / "machine.toml"
    path.write_text(head + "".join(texts), encoding="utf-8")
    return path


def edited(folder: Path, *edits: tuple[str, str]) -> Path:
    """A copy of the spindle's description in `folder` with texts replaced."""
    text = (SPINDLE / "machine.toml").read_text(encoding="utf-8")
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new)
    path = folder / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def climbing(folder: Path) -> Path:
    """The spindle set upright, x pointing up, in air that is 6 K warmer per metre: films that follow, over what moves
    and what stands."""
    return edited(
        folder,
        ('reference_temperature = "20 degC"', 'reference_temperature = "20 degC"\nvertical = "x"'),
        ('signal = "shop_air"\n\n[environment.coolant]',
         'signal = "shop_air"\ngradient = "6 K/m"\nheight = 0.2\n\n[environment.coolant]'),
        ('mass = "12 kg"', 'mass = "12 kg"\nposition = [0.4, 0.0, 0.5]'),
        ('mass = "40 kg"', 'mass = "40 kg"\nposition = [0.1, 0.0, 0.4]'),
        ('capacity = "180 kJ/K"', 'capacity = "180 kJ/K"\nposition = [-0.3, 0.0, 0.2]'),
        ('[films.air]\nlaw = "constant_film"', '[films.air]\nlaw = "free_vertical_plate"'),
        ('parameters = { natural = "6 W/(m^2*K)" }', 'parameters = { height = "300 mm" }'),
    )  # fmt: skip
