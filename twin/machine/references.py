"""Cross-checks of a description without its meshes: does every name mean something, does every entry make sense?

Entries that are themselves broken are None in the machine given here: names that point at them are not reported again.
Problems name their place by the dotted path; `load_machine` adds file and line.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from itertools import pairwise
from pathlib import Path

from twin.errors import Problem, TwinError
from twin.machine import description, wiring
from twin.machine.added import added_problems
from twin.machine.bodies import bodies_of
from twin.machine.description import BOX_SURFACES, Machine
from twin.machine.displaced import elastic_constants, held_by_a_gap
from twin.machine.encoders import encoder_problems, scale_problems
from twin.machine.free_nodes import free_node_problems, on_parts
from twin.machine.kinematics import linear_axes, rail_moves
from twin.machine.lumped_references import (
    bodies_without_film,
    heated_place,
    joint_law_problems,
    lumped_problems,
    misplaced,
)
from twin.machine.parameters import parameter_problems
from twin.machine.platform import closure_problems, platform_problems
from twin.machine.size import refused
from twin.nearest import did_you_mean, nearest
from twin.units import parse_unit

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")
_NAMED = (
    "materials", "parts", "nodes", "bars", "axes", "contacts", "tanks", "scales", "signals", "environment", "sources",
    "films", "sensors", "struts", "supports",
)  # fmt: skip


def reference_problems(machine: Machine) -> list[Problem]:
    """All problems that need more than one entry, or more than its type, to be seen."""
    problems = [*_names(machine)]
    of_meshes = (
        _parts, _axes, _contacts, _laws, _films, _sensors, _watched, _tcp, _supports, misplaced, _added,
        free_node_problems,
    )  # fmt: skip
    for check in (
        platform_problems,
        *((lumped_problems, _axes, _laws, _sensors, _added) if machine.lumped else of_meshes),
        _poses,
        refused,
    ):
        problems += check(machine)
    whole = not any(entry is None for section in _NAMED for entry in getattr(machine, section).values())
    return problems or (list(_motion(machine)) if whole else [])


def _each(entries: Mapping, convert: Callable[[str], object]) -> Iterator[Problem]:
    """The problems that `convert` raises for the entries that are not broken."""
    for name, entry in entries.items():
        if entry is not None:
            try:
                convert(name)
            except TwinError as e:
                yield from e.problems


def _names(machine: Machine) -> Iterator[Problem]:
    for section in _NAMED:
        for name in getattr(machine, section):
            if not _NAME.fullmatch(name):
                remedy = "letters, digits, _ and - only: names make the dotted paths of parameters"
                yield Problem(f"'{name}' cannot be a name", f"{section}.{name}", remedy)


def _parts(machine: Machine) -> Iterator[Problem]:
    if not machine.parts:
        remedy = "add at least one [parts.NAME] with a material and a mesh or a box, or [nodes.NAME] with a capacity"
        yield Problem("no parts", "parts", remedy)
    yield from elastic_constants(machine)
    for name, part in machine.parts.items():
        if part is None:
            continue
        where = f"parts.{name}"
        if part.material not in machine.materials:
            remedy = did_you_mean(part.material, machine.materials, "materials")
            yield Problem(f"unknown material '{part.material}'", f"{where}.material", remedy)
        if (part.mesh is None) == (part.box is None):
            yield Problem("give either a mesh or a box", where, 'set mesh = "file.msh" or box = {...}, not both')
        elif part.mesh is not None and not (machine.folder / part.mesh).is_file():
            yield Problem(f"no mesh file '{part.mesh}'", f"{where}.mesh", _files_like(machine.folder / part.mesh))
        elif part.box is not None and (min(part.box.size) <= 0 or min(part.box.divisions) < 1):
            yield Problem("a box without volume or elements", f"{where}.box", "sizes must be > 0 and divisions >= 1")
        try:
            if parse_unit(part.mesh_unit).si != "m":
                raise ValueError(f"'{part.mesh_unit}' is not a length")
        except ValueError as e:
            yield Problem(str(e), f"{where}.mesh_unit", 'write mesh_unit = "mm"')
        for surface in part.adiabatic:
            yield from _surface(f"{name}.{surface}", f"{where}.adiabatic", machine)


def _files_like(path: Path) -> str:
    beside = sorted(p.name for p in path.parent.iterdir() if p.is_file()) if path.parent.is_dir() else []
    close = nearest(path.name, beside)
    return f"did you mean '{close}'?" if close else "paths are relative to machine.toml"


def _surface(surface: str, where: str, machine: Machine, wildcard: bool = False) -> Iterator[Problem]:
    """Is "part.surface" of a known part, and of a known surface where the part is a box?"""
    part_name, _, name = surface.partition(".")
    if not (part_name and name):
        yield Problem(f"'{surface}' is not a surface", where, "write surfaces as 'part.surface', for example 'bed.top'")
    elif part_name not in machine.parts:
        yield Problem(f"unknown part in '{surface}'", where, did_you_mean(part_name, machine.parts, "parts"))
    elif name == "*":
        if not wildcard:
            yield Problem("'*' stands for surfaces in films only, not in additional ones", where, "name the surface")
    elif (part := machine.parts[part_name]) and part.box and not part.mesh and name not in BOX_SURFACES:
        yield Problem(f"unknown surface '{surface}'", where, did_you_mean(name, BOX_SURFACES, "surfaces of a box"))


def _axes(machine: Machine) -> Iterator[Problem]:
    for name, entry in machine.axes.items():
        if entry is None:
            continue
        where = f"axes.{name}"
        if not entry.carries:
            yield Problem("carries no part", f"{where}.carries", "list the parts that move with the axis")
        for part in entry.carries:
            if part not in machine.members:
                remedy = did_you_mean(part, machine.members, "nodes and bars" if machine.lumped else "parts")
                yield Problem(f"unknown part '{part}'", f"{where}.carries", remedy)
        if entry.kind == "rotary" and not math.hypot(*entry.direction) > 0:
            yield Problem("the direction has no length", f"{where}.direction", "give a vector like [1, 0, 0]")
        if entry.kind == "linear" and entry.point is not None:
            yield Problem("'point' of a linear axis", f"{where}.point", "remove it: only a rotary axis has a place")
        if entry.kind == "rotary" and entry.position not in machine.signals:
            remedy = did_you_mean(entry.position, machine.signals, "signals")
            yield Problem(f"unknown signal '{entry.position}'", f"{where}.position", remedy)
        if machine.lumped:
            continue
        yield from encoder_problems(name, entry)
        for key in ("scale", "reader"):
            if (surface := getattr(entry.encoder, key)) is not None:
                yield from _surface(surface, f"{where}.encoder.{key}", machine)
    linear = {n: a for n, a in machine.axes.items() if a is not None and a.kind == "linear"}
    yield from _each(linear, lambda name: wiring.axis(name, machine))


def _contacts(machine: Machine) -> Iterator[Problem]:
    for name, entry in machine.contacts.items():
        if entry is not None:
            yield from (_fixed if entry.kind == "fixed" else _moving)(entry, f"contacts.{name}", machine)
            try:
                wiring.joint_conductance(name, machine)
            except TwinError as e:
                yield from e.problems


def _fixed(entry: description.Contact, where: str, machine: Machine) -> Iterator[Problem]:
    if entry.surfaces is None:
        yield Problem("a fixed contact without surfaces", where, "give surfaces = ['part.surface', 'part.surface']")
    for key in ("axis", "pairs", "segments", "stiffness"):
        if key in entry.model_fields_set:
            yield Problem(
                f"'{key}' in a fixed contact",
                f"{where}.{key}",
                "remove it: fixed contacts are glued; or kind = 'moving'",
            )
    for surface in entry.surfaces or ():
        yield from _surface(surface, f"{where}.surfaces", machine)
    if entry.surfaces and entry.surfaces[0].split(".")[0] == entry.surfaces[1].split(".")[0]:
        yield Problem("both surfaces are of one part", f"{where}.surfaces", "join two parts")


def _moving(entry: description.Contact, where: str, machine: Machine) -> Iterator[Problem]:
    linear = [n for n, a in machine.axes.items() if a is None or a.kind == "linear"]
    if entry.axis not in linear:
        what = f"'{entry.axis}' is not a linear axis" if entry.axis else "a moving contact without an axis"
        yield Problem(what, f"{where}.axis", did_you_mean(entry.axis or "", linear, "linear axes"))
    if entry.gap is not None:
        remedy = "remove it: pads lie on their rails; or kind = 'fixed'"
        yield Problem("'gap' in a moving contact", f"{where}.gap", remedy)
    if "surfaces" in entry.model_fields_set:
        yield Problem(
            "'surfaces' in a moving contact",
            f"{where}.surfaces",
            "write pairs = [['rail part.surface', 'pad part.surface']]",
        )
    if not entry.pairs:
        yield Problem(
            "a moving contact without pairs", where, "give pairs = [['rail part.surface', 'pad part.surface']]"
        )
    for pair in entry.pairs:
        for surface in pair:
            yield from _surface(surface, f"{where}.pairs", machine)
        if pair[0].split(".")[0] == pair[1].split(".")[0]:
            yield Problem(f"'{pair[0]}' runs on its own part", f"{where}.pairs", "a pad runs on another part's rail")


def _added(machine: Machine) -> Iterator[Problem]:
    judge = heated_place if machine.lumped else _surface
    yield from added_problems(machine, lambda place, where: judge(place, where, machine))
    for name in machine.scales if not (machine.lumped or machine.has_tcp) else ():
        remedy = "describe [tcp.tool] and [tcp.work], or remove it"
        yield Problem("a scale moves the TCP, and there is none", f"scales.{name}", remedy)


def _laws(machine: Machine) -> Iterator[Problem]:
    yield from _each(machine.signals, lambda name: wiring.signal(name, machine.signals[name]))
    yield from _each(machine.environment, lambda name: wiring.environment(name, machine.environment[name], machine))
    yield from _each(machine.sources, lambda name: wiring.source(name, machine.sources[name], machine))
    yield from _each(machine.films, lambda name: wiring.film_law(name, machine.films[name], machine))
    for name, entry in machine.sources.items():
        if (
            entry is not None
            and entry.surface is not None
            and not machine.lumped
            and entry.surface not in machine.nodes
        ):
            yield from _surface(entry.surface, f"sources.{name}.surface", machine)


def _films(machine: Machine) -> Iterator[Problem]:
    owner: dict[str, str] = {}
    for name, film in machine.films.items():
        for surface in on_parts(machine, film) if film is not None else ():
            where = f"films.{name}.surfaces"
            yield from _surface(surface, where, machine, wildcard=not film.additional)
            if not film.additional and owner.setdefault(surface, name) != name:
                yield Problem(f"'{surface}' is also in films.{owner[surface]}", where, "leave it to one of them")
    if not machine.films:
        yield Problem("no films", "films", "without a film no heat leaves the machine: add a [films.NAME]")


def _sensors(machine: Machine) -> Iterator[Problem]:
    for name, sensor in machine.sensors.items():
        if sensor is None:
            continue
        where = f"sensors.{name}"
        if (sensor.environment is None) == (sensor.part is None):
            yield Problem(
                "give either a part or an environment",
                where,
                'part = "bed" and position = [...], or environment = "shop"',
            )
        elif sensor.part is not None:
            if machine.lumped:
                continue
            if sensor.part not in machine.parts:
                yield Problem(
                    f"unknown part '{sensor.part}'", f"{where}.part", did_you_mean(sensor.part, machine.parts, "parts")
                )
            if sensor.position is None:
                yield Problem(
                    "a sensor on a part without a position",
                    where,
                    "write position = [0.1, 0.2, 0.3], at axis positions zero",
                )
        elif sensor.environment not in machine.environment:
            remedy = did_you_mean(str(sensor.environment), machine.environment, "environments")
            yield Problem(f"unknown environment '{sensor.environment}'", f"{where}.environment", remedy)


def _tcp(machine: Machine) -> Iterator[Problem]:
    if machine.tcp is None or not machine.tcp.model_fields_set:
        return  # reported on reading
    for side in ("tool", "work"):
        if side not in machine.tcp.model_fields_set:
            yield Problem(f"missing key '{side}'", f"tcp.{side}", 'write surface = "table.top"')
            return
    yield from _surface(machine.tcp.tool.surface, "tcp.tool.surface", machine)
    yield from _surface(machine.tcp.work.surface, "tcp.work.surface", machine)
    if machine.tcp.tool.point is None:
        yield Problem(
            "no tool centre point",
            "tcp.tool",
            "write point = [0, 0, 0.3], in machine coordinates at axis positions zero",
        )
    if machine.tcp.work.point is not None:
        yield Problem(
            "a point on the work side", "tcp.work.point", "remove it: the work side is read at the tool centre point"
        )


def _watched(machine: Machine) -> Iterator[Problem]:
    """Without a sensor in the machine and without a TCP a certificate would pass over nothing."""
    inside = [s for s in machine.sensors.values() if s is None or s.environment is None]
    if machine.parts and not machine.has_tcp and not inside:
        yield Problem("nothing is watched", "sensors", "add a [sensors.NAME] in a part, or [tcp.tool] and [tcp.work]")


def _supports(machine: Machine) -> Iterator[Problem]:
    if not machine.supports and machine.has_tcp:
        yield Problem("no supports", "supports", "the machine must stand on something: add a [supports.NAME]")
    for name, support in machine.supports.items():
        if support is not None:
            yield from _surface(support.surface, f"supports.{name}.surface", machine)
            if min(support.stiffness) < 0 or not max(support.stiffness) > 0:
                yield Problem(
                    "stiffness must be >= 0 and not all zero", f"supports.{name}.stiffness", 'e.g. "200 N/um"'
                )


def _poses(machine: Machine) -> Iterator[Problem]:
    axes = machine.axes
    linear = [n for n, a in axes.items() if a is None or a.kind == "linear"]
    for name, grid in machine.poses.items():
        where = f"poses.{name}"
        if name not in linear:
            yield Problem(f"unknown linear axis '{name}'", where, did_you_mean(name, linear, "linear axes"))
            continue
        if grid is None:
            continue
        if isinstance(grid, int):
            if grid < 1:
                yield Problem(f"{grid} positions", where, "at least 1; 5 is usual")
            continue
        if not grid or any(b <= a for a, b in pairwise(grid)):
            yield Problem("positions do not increase", where, "list each position once, in order")
        elif axes[name] is not None and not (axes[name].stroke[0] <= grid[0] and grid[-1] <= axes[name].stroke[1]):
            low, high = axes[name].stroke
            yield Problem(f"positions leave the stroke {low:g} .. {high:g} m", where, "stay within the stroke")


def _motion(machine: Machine) -> Iterator[Problem]:
    """Does every axis carry exactly one side of its contacts? Asked only of a description without other mistakes."""
    yield from held_by_a_gap(machine)
    for contact in machine.contacts.values():
        for rail, pad in contact.pairs:
            try:
                rail_moves(machine, str(contact.axis), rail, pad)
            except TwinError as e:
                yield from e.problems
    if machine.tcp is not None:
        yield from parameter_problems(machine)
    if machine.lumped:
        yield from joint_law_problems(machine)
        yield from closure_problems(machine)
        yield from bodies_without_film(machine, [body.parts for body in bodies_of(machine)])
        return
    with suppress(TwinError):  # axes that carry the wrong side are reported above
        yield from scale_problems(machine)
    used = {c.axis for c in machine.contacts.values()}
    for name in linear_axes(machine):
        if name not in used:
            yield Problem(
                "no moving contact has this axis",
                f"axes.{name}",
                "join its two sides by guides and a screw",
                warning=True,
            )
