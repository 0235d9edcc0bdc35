"""A small lumped spindle in a hall, and what nobody described: a body that follows the wall and moves the tool."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from twin.build.pipeline import BuildOptions, rich_model
from twin.build.simulate import Noise, simulate_run
from twin.logs.run import Run, Table, Tcp
from twin.machine.description import Machine
from twin.machine.load import load_machine
from twin.machine.parameters import parameters
from twin.rom.artefact import Artefact

TEXT = """
[machine]
name = "small"
reference_temperature = "20 degC"

[nodes.shaft]
capacity = "8 kJ/K"
area = "0.05 m^2"

[nodes.housing]
capacity = "20 kJ/K"
area = "0.3 m^2"

[contacts.bearings]
kind = "fixed"
surfaces = ["shaft", "housing"]
total = "5 W/K"

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
surface = "shaft"
parameters = { power = "150 W", reference = "5000 1/min", exponent = 1.67 }
signals = { speed = "speed" }

[films.all]
law = "constant_film"
surfaces = ["shaft", "housing"]
environment = "air"
emissivity = 0.0
parameters = { natural = "10 W/(m^2*K)" }

[sensors.shaft]
part = "shaft"

[tcp.expansion]
shaft = ["0.2 um/K", "0.2 um/K", "2.3 um/K"]
housing = ["1 um/K", "1 um/K", "3.5 um/K"]
"""
HIDDEN = """
[signals.wall]
unit = "degC"
range = [0.0, 50.0]

[environment.wall]
signal = "wall"

[nodes.column]
capacity = "2.4 kJ/K"
area = "0.1 m^2"

[films.column]
law = "constant_film"
surfaces = ["column"]
environment = "wall"
emissivity = 0.0
parameters = { natural = "10 W/(m^2*K)" }
"""
MOVES = 'column = ["0 um/K", "6 um/K", "-4 um/K"]\n'


def machine(folder: Path, text: str = TEXT) -> Machine:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "machine.toml").write_text(text, encoding="utf-8")
    return load_machine(folder)


def artefact(folder: Path, text: str = TEXT) -> Artefact:
    m = machine(folder, text)
    return Artefact(rich_model(m, None, BuildOptions().rich), text, {}, {}, (), parameters(m), "", m.machine.name)


def hidden(text: str = TEXT) -> str:
    """The real machine: other parameters within tolerance, and the column that stands at the wall."""
    text = text.replace('"150 W"', '"165 W"').replace('natural = "10 W', 'natural = "11 W', 1)
    return text.rstrip() + "\n" + MOVES + HIDDEN


@cache
def loads(seed: int, hours: float = 10.0) -> Run:
    """Speeds in steps, air and wall that move on their own, and the door's, which tells nothing."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, hours * 3600.0 + 1.0, 60.0)
    n, block = len(time), 90
    speed = np.repeat(rng.choice([0.0, 1500.0, 3000.0, 4500.0], n // block + 1), block)[:n] / 60.0

    def drift(size: float) -> np.ndarray:
        slow = np.cumsum(rng.standard_normal(n)) / 60.0
        return 22.0 + size * (slow - slow[0])

    columns = {"speed": speed, "air": drift(2.0), "wall": drift(4.0), "door": drift(4.0)}
    units = {"speed": "1/s", "air": "degC", "wall": "degC", "door": "degC"}
    tcp = Tcp(time[::10], (), np.zeros((len(time[::10]), 0)), np.zeros((len(time[::10]), 3)))
    return Run(Table(time, columns, units), tcp=tcp, steady_start=True, folder=Path(f"run_{seed}"))


def measured(real: Machine, seed: int) -> Run:
    """A run of the real machine with noise, counted from its first row."""
    base = loads(seed)
    made, _ = simulate_run(real, base, noise=Noise(0.05, 0.3e-6, seed))
    first = made.tcp.displacement[0]
    return replace(
        made,
        tcp=replace(made.tcp, displacement=made.tcp.displacement - first),
        tcp_reference="first",
        folder=base.folder,
    )
