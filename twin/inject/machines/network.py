"""The description of a drawn lumped machine: a network of nodes, with an axis on a ball screw in every second one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.inject.machines.draws import between, one_of, rounded, with_unit
from twin.inject.machines.films import constant_film, moved_film, still_film
from twin.inject.machines.heat import Heat, drive_law, heat, signal_table
from twin.inject.machines.machine_of_boxes import AIR
from twin.inject.machines.materials import material_tables
from twin.machine.toml_text import Section, Table, toml_text

STRUCTURE = ("bed", "column", "headstock", "arm", "frame")  # in the order of the flow of forces, from the ground
UNITS = ("motor", "spindle_bearing", "gearbox", "hydraulics", "cover", "second_motor")  # small, at one of the structure
SCREW = 500  # mm
VOLUMETRIC_CAPACITY = 3.6e6  # J/(m^3 K), of iron and steel: capacity over it is a volume


@dataclass(frozen=True)
class _Node:
    """A node: capacity [J/K], area [m^2], and whether the axis carries it."""

    name: str
    capacity: float
    area: float
    moves: bool = False


@dataclass(frozen=True)
class _Link:
    """A fixed contact [W/K]."""

    ends: tuple[str, str]
    total: float

    @property
    def name(self) -> str:
        return "_to_".join(end.replace(".", "_") for end in self.ends)


def network(rng: np.random.Generator, name: str) -> tuple[Callable[[float], str], int]:
    """The text of a machine.toml as a function of a factor of all powers, and the number of nodes and bars."""
    axis = bool(rng.random() < 0.5)
    nodes = _nodes(rng, axis)
    links = _links(rng, nodes, axis)
    sources = _sources(rng, nodes, axis)
    materials = material_tables(rng, ["steel"] if axis else [])
    films = _films(rng, nodes, axis)
    told = (*_sensors(rng, nodes, axis), *_tcp(rng, nodes, axis))
    names = sorted({n for s in sources for n in s.signals.values()} | ({"x_speed"} if axis else set()))
    signals = [Table(f"signals.{n}", signal_table(n)) for n in names] + [Table("signals.shop_air", AIR)]
    entries = {
        "name": name,
        "description": f"network of {len(nodes)} nodes" + (", one axis on a ball screw" if axis else ""),
        "reference_temperature": "20 degC",
    }
    first = (
        Section("", (Table("machine", entries),)),
        Section("materials", materials),
        Section("nodes", (*(_node(n) for n in nodes), *(_bar() if axis else ()))),
        Section("axes and contacts", (*(_axis(rng, nodes) if axis else ()), *(_link(k) for k in links))),
    )
    environment = Table("environment.shop", {"signal": "shop_air"})
    rest = (Section("signals, environments, films", (*signals, environment, *films)), Section("sensors and TCP", told))

    def text(factor: float) -> str:
        hot = Section("heat", tuple(Table(f"sources.{s.name}", s.table(factor)) for s in sources))
        return toml_text("Drawn from a seed. A network of capacities and conductances; x along the screw, z up.",
                         (*first, hot, *rest))  # fmt: skip

    return text, len(nodes) + axis


def _nodes(rng: np.random.Generator, axis: bool) -> tuple[_Node, ...]:
    """Structure from heavy to light, then units, then a slide with its nut: 4 to 10 nodes."""
    heavy = int(rng.integers(2, len(STRUCTURE) + 1))
    small = int(rng.integers(2 if axis else max(2, 4 - heavy), 4 if axis else 6))
    capacity, found = between(rng, 60e3, 250e3), []
    for name in STRUCTURE[:heavy]:
        found.append(_sized(rng, name, capacity))
        capacity = rounded(capacity * rng.uniform(0.4, 0.8))
    for k in sorted(rng.choice(len(UNITS), size=min(small, 10 - heavy - 2 * axis), replace=False)):
        found.append(_sized(rng, UNITS[k], between(rng, 1.5e3, 9e3)))
    if axis:
        found.append(_sized(rng, "slide", between(rng, 12e3, 40e3), True))
        found.append(_sized(rng, "nut", between(rng, 500.0, 900.0), True))
    return tuple(found)


def _sized(rng: np.random.Generator, name: str, capacity: float, moves: bool = False) -> _Node:
    """With the area of a body of its volume whose walls are some 60 mm thick, less for small ones."""
    wall = min(0.06, 0.4 * (capacity / VOLUMETRIC_CAPACITY) ** (1.0 / 3.0))
    return _Node(name, capacity, rounded(capacity / VOLUMETRIC_CAPACITY / wall * rng.uniform(0.8, 1.3)), moves)


def _links(rng: np.random.Generator, nodes: Sequence[_Node], axis: bool) -> tuple[_Link, ...]:
    """A tree: each of the structure at the one before it, each unit at one of the structure; sometimes a loop."""
    heavy = [n.name for n in nodes if n.name in STRUCTURE]
    units = [n.name for n in nodes if n.name in UNITS]
    found = [_Link(ends, between(rng, 8.0, 40.0)) for ends in zip(heavy[1:], heavy[:-1], strict=True)]
    at = {unit: one_of(rng, heavy) for unit in units}
    found += [_Link((unit, at[unit]), between(rng, 2.0, 10.0)) for unit in units]
    free = [(u, h) for u in units for h in heavy if at[u] != h]
    if free and rng.random() < 0.4:
        found.append(_Link(one_of(rng, free), between(rng, 0.5, 3.0)))
    if axis:
        found += [_Link(("nut", "slide"), between(rng, 4.0, 10.0)), _Link(("screw.start", "bed"), between(rng, 2, 6))]
    return tuple(found)


def _sources(rng: np.random.Generator, nodes: Sequence[_Node], axis: bool) -> list[Heat]:
    """Two to four, most of them in units."""
    found = []
    for unit in (n.name for n in nodes if n.name in UNITS and n.name != "cover"):
        law = _law(rng, unit)
        of = "x" if axis and unit == "motor" else "drive"
        found.append(heat(rng, unit, law, {"surface": unit}, of if law in _OF_AXES else ""))
    if axis:
        place = {"contact": "x_screw", "rail_share": rounded(rng.uniform(0.3, 0.7), 2)}
        found.append(heat(rng, "x_screw", "screw_friction", place, "x"))
    if len(found) < 2:
        found.append(heat(rng, "electronics", "constant_heat", {"surface": "column"}))
    count = int(rng.integers(2, 5))
    kept = sorted(rng.choice(len(found), size=min(count, len(found)), replace=False))
    return [found[k] for k in kept]


_OF_AXES = ("motor_copper", "motor_winding", "axis_motor")


def _law(rng: np.random.Generator, unit: str) -> str:
    if unit.endswith("motor"):
        return drive_law(rng) if rng.random() < 0.7 else "motor_copper"
    if unit == "spindle_bearing":
        return one_of(rng, ("bearing_friction", "bearing_friction_warm", "turning_heat"))
    return one_of(rng, ("turning_heat",) if unit == "gearbox" else ("constant_heat", "switched_heat"))


def _films(rng: np.random.Generator, nodes: Sequence[_Node], axis: bool) -> list[Table]:
    heavy = [n.name for n in nodes if n.name in STRUCTURE]
    units = [n.name for n in nodes if n.name in UNITS]
    tables = [
        Table("films.structure", still_film(rng, heavy, "shop", int(rng.integers(200, 700)))),
        Table("films.units", constant_film(rng, units, "shop")),
    ]
    if axis:
        tables.append(Table("films.moving", moved_film(rng, ["slide", "nut", "screw"], "shop", 300, "x_speed")))
    return tables


def _sensors(rng: np.random.Generator, nodes: Sequence[_Node], axis: bool) -> list[Table]:
    """Four at least; the air has one."""
    names = [n.name for n in nodes]
    count = int(rng.integers(min(3, len(names)), len(names) + 1))
    kept = sorted(rng.choice(len(names), size=count, replace=False))
    tables = [Table(f"sensors.{names[k]}", {"part": names[k]}) for k in kept]
    if axis and rng.random() < 0.5:
        at = int(rng.integers(-SCREW // 3, SCREW // 3 + 1))
        tables.append(Table("sensors.screw", {"part": "screw", "position": [f"{at} mm", "0 mm", "0 mm"]}))
    return [*tables, Table("sensors.shop", {"environment": "shop"})]


def _tcp(rng: np.random.Generator, nodes: Sequence[_Node], axis: bool) -> list[Table]:
    """The tool side grows away from the work; what one node moves is that of 50 to 500 mm of iron."""
    rows = {}
    for n in nodes:
        if n.name in STRUCTURE or n.name in ("spindle_bearing", "slide"):
            main, sign = int(rng.integers(3)), float(one_of(rng, (-1.0, 1.0, 1.0)))
            row = [rounded(sign * rng.uniform(0.5, 5.0) if i == main else rng.uniform(-0.8, 0.8), 2) for i in range(3)]
            rows[n.name] = [with_unit(v, "um/K") for v in row]
    tables = [Table("tcp.expansion", rows)]
    if axis:
        tables += [Table("tcp.screws", {"screw": one_of(rng, ("tool", "work"))}), Table("poses", {"x": 3})]
    return tables


def _node(n: _Node) -> Table:
    entries: dict[str, Any] = {"capacity": f"{n.capacity / 1e3:g} kJ/K", "area": f"{n.area:g} m^2"}
    return Table(f"nodes.{n.name}", entries | ({"position": ["0 mm"] * 3} if n.name == "nut" else {}))


def _bar() -> tuple[Table, ...]:
    """A screw of 32 mm with its fixed bearing at the start."""
    entries = {
        "material": "steel", "origin": [f"{-SCREW // 2} mm", "0 mm", "0 mm"], "direction": [1.0, 0.0, 0.0],
        "length": f"{SCREW} mm", "cross_section": "8 cm^2", "perimeter": "101 mm", "elements": 10, "fixed_end": "start",
    }  # fmt: skip
    return (Table("bars.screw", entries),)


def _axis(rng: np.random.Generator, nodes: Sequence[_Node]) -> tuple[Table, ...]:
    reach = 10 * int(rng.integers(10, 22))
    carried = [n.name for n in nodes if n.moves and n.name != "nut"]
    return (
        Table("axes.x", {"direction": [1.0, 0.0, 0.0], "stroke": [f"{-reach} mm", f"{reach} mm"], "carries": carried,
                         "position": "x_position"}),
        Table("contacts.x_screw", {"kind": "moving", "axis": "x", "pairs": [["screw", "nut"]],
                                   "total": f"{between(rng, 6.0, 14.0):g} W/K"}),
        Table("signals.x_position", {"unit": "mm", "range": [-float(reach), float(reach)]}),
    )  # fmt: skip


def _link(k: _Link) -> Table:
    return Table(f"contacts.{k.name}", {"kind": "fixed", "surfaces": list(k.ends), "total": f"{k.total:g} W/K"})
