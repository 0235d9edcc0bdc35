"""The real machine of a description: another mesh, other laws of films, values off by what a designer cannot know."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from twin.inject.machines.draws import rounded
from twin.inject.machines.other_films import other_film
from twin.inject.machines.text_edits import with_table, with_values
from twin.machine.check_lumped import node_capacity
from twin.machine.description import Machine
from twin.machine.edit import edited
from twin.machine.instances import written_out
from twin.machine.load import load_machine
from twin.machine.parameters import parameters
from twin.machine.toml_spans import Keys
from twin.machine.toml_text import value_text

# Half widths of uniform factors around 1, by kind of parameter: losses of catalogues, film correlations, joints whose
# flatness and oil nobody knows, material data of tables
OFF: dict[str, float] = {
    "source": 0.10, "film": 0.20, "joint": 0.30, "contact": 0.30, "capacity": 0.04, "expansion": 0.03,
}  # fmt: skip
ASIDE = (0.001, 0.004)  # m, from where the description has a sensor; farther off it would leave its part
FINER = (1.25, 1.6)  # of divisions; a node needs company to be split
SPLIT_FROM = 8e3  # J/K: lighter nodes are at one temperature
SETTLES = (300.0, 1200.0)  # s, in which the inside of a split node follows its outside


def other(text: str, seed: int, folder: Path = Path("."), off: Mapping[str, float] = OFF) -> str:
    """The text of the real machine that a description stands for, drawn from a seed (>= 0).

    Boxes and bars get other divisions, films other laws that agree with the described ones near 5 K above the air,
    sensors move by 1 to 4 mm, heavy nodes of lumped machines are split into an outside and an inside, and parameters
    that a calibration may fit (`twin.machine.parameters`) are off by up to `off`. Names stay, nodes are added. It is
    a machine without a fault: what is hidden in it comes on top. folder: where the text lies or would lie. off: half
    widths of uniform factors around 1, by kind of parameter.

    Raises DescriptionError for text that is no sound description. Machines with mesh files keep their meshes.
    """
    rng, path = np.random.default_rng(seed), folder / "machine.toml"
    machine, text = load_machine(path, text), written_out(text)
    for name in machine.films:
        if entries := other_film(rng, machine, name):
            text = with_table(text, ("films", name), entries)
    text = with_values(text, _mesh(rng, machine) | _sensors(rng, machine))
    text = _split(rng, text, machine)
    known = [p for p in parameters(load_machine(path, text)) if p.kind in off]
    return edited(text, {p.path: p.nominal * (1.0 + rng.uniform(-off[p.kind], off[p.kind])) for p in known})


def other_divisions(rng: np.random.Generator, divisions: tuple[int, ...]) -> tuple[int, ...]:
    """More divisions of a box or bar, none of them a multiple of the old ones but along edges with a single element.

    Such edges keep it; of a box that is one element one edge gets two.
    """
    if max(divisions) == 1:
        split = int(rng.integers(len(divisions)))
        return tuple(2 if i == split else 1 for i in range(len(divisions)))
    return tuple(n if n == 1 else min(max(n + 1, round(n * rng.uniform(*FINER))), 2 * n - 1) for n in divisions)


def _mesh(rng: np.random.Generator, machine: Machine) -> dict[Keys, str]:
    """Divisions of boxes, segments of their guides and screws, elements of bars."""
    found: dict[Keys, str] = {}
    for name, part in machine.parts.items():
        if part.box is not None:
            found["parts", name, "box", "divisions"] = value_text(other_divisions(rng, part.box.divisions))
    for name, contact in machine.contacts.items():
        if contact.kind == "moving" and not machine.lumped:
            found["contacts", name, "segments"] = value_text(other_divisions(rng, (contact.segments,))[0])
    for name, bar in machine.bars.items():
        found["bars", name, "elements"] = value_text(other_divisions(rng, (bar.elements,))[0])
    return found


def _sensors(rng: np.random.Generator, machine: Machine) -> dict[Keys, str]:
    """Positions some mm aside."""
    found: dict[Keys, str] = {}
    for name, sensor in machine.sensors.items():
        if sensor.position is not None:
            shift = rng.standard_normal(3)
            shift *= rng.uniform(*ASIDE) / np.linalg.norm(shift)
            at = [f"{1e3 * v:.2f} mm" for v in np.add(sensor.position, shift)]
            found["sensors", name, "position"] = value_text(at)
    return found


def _split(rng: np.random.Generator, text: str, machine: Machine) -> str:
    """Heavy nodes with a given capacity as an outside, which keeps the name and all it touches, and an inside.

    Both grow: the row of [tcp.expansion] is shared as the capacity is.
    """
    heavy = [
        n for n, node in machine.nodes.items() if node.capacity is not None and node_capacity(machine, n) > SPLIT_FROM
    ]
    added = []
    for name in heavy:
        share, settles, capacity = rng.uniform(0.4, 0.7), rng.uniform(*SETTLES), node_capacity(machine, name)
        inside, total = f"{name}_inside", capacity * share * (1.0 - share) / settles
        values: dict[Keys, str] = {("nodes", name, "capacity"): value_text(f"{rounded(share * capacity, 4):g} J/K")}
        if (row := machine.tcp.expansion.get(name)) is not None:
            for key, part in ((name, share), (inside, 1.0 - share)):
                values["tcp", "expansion", key] = value_text([f"{1e6 * part * v:.4g} um/K" for v in row])
        text = with_values(text, values)
        added.append(
            f'[nodes.{inside}]\ncapacity = "{rounded((1.0 - share) * capacity, 4):g} J/K"\n\n'
            f'[contacts.{inside}]\nkind = "fixed"\nsurfaces = ["{name}", "{inside}"]\ntotal = "{total:.4g} W/K"\n'
        )
    return "\n".join([text, *added]) if added else text
