"""Cross-checks of a lumped machine's description: nodes, bars, what touches them, and what has no place beside them.

As in `references`, entries that are themselves broken are None, and names that point at them are not reported again.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from twin.errors import Problem, TwinError
from twin.machine import description, wiring
from twin.machine.bodies import owner_of
from twin.machine.description import Machine
from twin.nearest import did_you_mean

ENDS = ("start", "end")
PARALLEL = 1e-3  # rad between a bar and the axis that runs on it


def lumped_problems(machine: Machine) -> Iterator[Problem]:
    """Problems of nodes, bars, contacts, films, sensors and the TCP of a lumped machine."""
    if both := [name for name in machine.nodes if name in machine.bars]:
        for name in both:
            yield Problem(f"'{name}' is also a bar", f"nodes.{name}", "give each node and bar a name of its own")
        return
    for check in (_nodes, _bars, _without_meshes, _contacts, _sources, _films, _sensors, _tcp):
        yield from check(machine)


def misplaced(machine: Machine) -> Iterator[Problem]:
    """What only a lumped machine may have, in one with meshes."""
    places: list[tuple[str, object, str]] = []
    for name, contact in machine.contacts.items():
        if contact is not None:
            places += [(f"contacts.{name}.area", contact.area, "the meshes know it: remove it")]
            places += [(f"contacts.{name}.total", contact.total, 'write conductance = "2000 W/(m^2*K)"')]
    places += [
        (f"films.{name}.area", film.area, "the meshes know it: remove it")
        for name, film in machine.films.items()
        if film is not None
    ]
    if machine.tcp is not None:
        remedy = "the meshes know it: remove it, and name the two sides as [tcp.tool] and [tcp.work]"
        places.append(("tcp.screws", machine.tcp.screws or None, remedy))
    for where, value, remedy in places:
        if value is not None:
            yield Problem(f"'{where.rpartition('.')[2]}' in a machine with meshes", where, remedy)


def _nodes(machine: Machine) -> Iterator[Problem]:
    for name, node in machine.nodes.items():
        if node is None:
            continue
        where = f"nodes.{name}"
        by_material = node.material is not None and (node.volume is None) != (node.mass is None)
        rest = any(value is not None for value in (node.material, node.volume, node.mass))
        if (node.capacity is not None and rest) or (node.capacity is None and not by_material):
            remedy = 'capacity = "1200 J/K", or material = "steel" with volume = "0.4 l" or mass = "3 kg"'
            yield Problem("give a capacity, or a material and how much of it", f"{where}.capacity", remedy)
        if node.material is not None:
            yield from _material(node.material, where, machine)


def _bars(machine: Machine) -> Iterator[Problem]:
    for name, bar in machine.bars.items():
        if bar is None:
            continue
        yield from _material(bar.material, f"bars.{name}", machine)
        if not np.linalg.norm(bar.direction) > 0:
            yield Problem("the direction has no length", f"bars.{name}.direction", "give a vector like [1, 0, 0]")


def _material(material: str, where: str, machine: Machine) -> Iterator[Problem]:
    if material not in machine.materials:
        remedy = did_you_mean(material, machine.materials, "materials")
        yield Problem(f"unknown material '{material}'", f"{where}.material", remedy)


def _without_meshes(machine: Machine) -> Iterator[Problem]:
    """Entries that need a mesh."""
    for name in machine.supports:
        remedy = "remove it: a lumped machine moves its tool by [tcp.expansion] and [tcp.screws]"
        yield Problem("a support of a lumped machine", f"supports.{name}", remedy)
    for name, axis in machine.axes.items():
        if axis is not None and axis.encoder.kind == "linear":
            remedy = "remove it, and give what the scale and the structure do to the tool in [tcp.expansion]"
            yield Problem("a linear encoder of a lumped machine", f"axes.{name}.encoder", remedy)


def _place(place: str, where: str, machine: Machine, whole: bool, ends: bool, nodes: bool = True) -> Iterator[Problem]:
    """Is `place` a node, a bar (where `whole` bars may stand), an end of a bar (where `ends` may)?"""
    name, dot, end = place.partition(".")
    if name not in machine.members:
        remedy = did_you_mean(name, machine.members, "nodes and bars")
        yield Problem(f"no node or bar '{name}'" + (f" in '{place}'" if dot else ""), where, remedy)
    elif name in machine.nodes:
        if dot:
            yield Problem(f"'{place}': a node has no surfaces", where, f"write '{name}'")
        elif not nodes:
            yield Problem(f"'{place}' is a node", where, did_you_mean(name, machine.bars, "bars"))
    elif dot and (end not in ENDS or not ends):
        remedy = did_you_mean(end, ENDS, "ends") if ends else f"write '{name}'"
        yield Problem(f"unknown surface '{place}' of a bar", where, remedy)
    elif not dot and not whole:
        yield Problem(f"'{place}' is a whole bar", where, f"name an end of it: '{name}.start' or '{name}.end'")


def heated_place(place: str, where: str, machine: Machine) -> Iterator[Problem]:
    """Is `place` a node, a bar or an end of a bar: where a source or a tank may be?"""
    return _place(place, where, machine, whole=True, ends=True)


def _contacts(machine: Machine) -> Iterator[Problem]:
    for name, contact in machine.contacts.items():
        if contact is None:
            continue
        where = f"contacts.{name}"
        yield from (_fixed if contact.kind == "fixed" else _moving)(contact, where, machine)
        yield from _strength(contact, where)
        foreign = {
            "stiffness": "a lumped machine does not bend",
            "segments": "the bar's elements are its segments",
            "gap": "nodes have no distance, their conductance says all",
        }
        for key, why in foreign.items():
            if key in contact.model_fields_set:
                yield Problem(f"'{key}' in a contact of a lumped machine", f"{where}.{key}", f"remove it: {why}")


def _strength(contact: description.Contact, where: str) -> Iterator[Problem]:
    """total, or area with a conductance or a joint law."""
    by_area = contact.conductance is not None or contact.joint is not None
    if contact.total is not None:
        for key in ("conductance", "joint", "area"):
            if getattr(contact, key) is not None:
                yield Problem(f"'{key}' beside 'total'", f"{where}.{key}", "give the one or the other")
    elif not by_area:
        remedy = 'total = "12 W/K", or area = "0.01 m^2" and conductance = "2000 W/(m^2*K)"'
        yield Problem("a contact without conductance", where, remedy)
    elif contact.area is None:
        remedy = 'add area = "0.01 m^2", or give total = "12 W/K" instead of the conductance'
        yield Problem("a conductance per area without an area", where, remedy)


def _fixed(contact: description.Contact, where: str, machine: Machine) -> Iterator[Problem]:
    if contact.surfaces is None:
        yield Problem("a fixed contact without surfaces", where, "give surfaces = ['node', 'bar.start'], for example")
    for key in ("axis", "pairs"):
        if key in contact.model_fields_set:
            yield Problem(f"'{key}' in a fixed contact", f"{where}.{key}", "remove it, or write kind = 'moving'")
    found = [
        problem
        for place in contact.surfaces or ()
        for problem in _place(place, f"{where}.surfaces", machine, whole=False, ends=True)
    ]
    yield from found
    if not found and contact.surfaces and owner_of(contact.surfaces[0]) == owner_of(contact.surfaces[1]):
        yield Problem("both ends are at one node or bar", f"{where}.surfaces", "join two of them")


def _moving(contact: description.Contact, where: str, machine: Machine) -> Iterator[Problem]:
    linear = [n for n, a in machine.axes.items() if a is None or a.kind == "linear"]
    if contact.axis not in linear:
        what = f"'{contact.axis}' is not a linear axis" if contact.axis else "a moving contact without an axis"
        yield Problem(what, f"{where}.axis", did_you_mean(contact.axis or "", linear, "linear axes"))
    if contact.surfaces is not None:
        yield Problem("'surfaces' in a moving contact", f"{where}.surfaces", "write pairs = [['bar', 'node']]")
    if not contact.pairs:
        yield Problem("a moving contact without pairs", where, "give pairs = [['bar', 'node']]: rail or screw, and pad")
    elsewhere = {r: c.axis for c in machine.contacts.values() if c is not None for r, _ in c.pairs}
    for rail, pad in contact.pairs:
        if elsewhere[rail] != contact.axis:
            remedy = "a rail or screw belongs to one axis: give each axis its bar"
            yield Problem(f"bar '{rail}' is of axis '{elsewhere[rail]}' too", f"{where}.pairs", remedy)
        yield from _pair(rail, pad, contact.axis or "", f"{where}.pairs", machine)


def _pair(rail: str, pad: str, axis_name: str, where: str, machine: Machine) -> Iterator[Problem]:
    """A bar along the axis, and a node with a position on it."""
    yield from _place(rail, where, machine, whole=True, ends=False, nodes=False)
    if pad not in machine.nodes:
        remedy = did_you_mean(pad, machine.nodes, "nodes")
        yield Problem(f"no node '{pad}'", where, f"a pair is a bar and the node on it; {remedy}")
    elif (node := machine.nodes[pad]) is not None and node.position is None:
        remedy = "where it is at axis positions zero: position = [0.1, 0, 0.2]"
        yield Problem(f"'{pad}' runs on '{rail}' but has no position", f"nodes.{pad}", remedy)
    bar, axis = machine.bars.get(rail), machine.axes.get(axis_name)
    if bar is None or axis is None:
        return
    lengths = np.linalg.norm(bar.direction) * np.linalg.norm(axis.direction)  # zero is reported elsewhere
    if np.linalg.norm(np.cross(bar.direction, axis.direction)) > PARALLEL * lengths:
        remedy = f"its direction {list(bar.direction)} must be that of axis '{axis_name}', or its opposite"
        yield Problem(f"bar '{rail}' is not parallel to the axis", where, remedy)


def _sources(machine: Machine) -> Iterator[Problem]:
    for name, source in machine.sources.items():
        if source is not None and source.surface is not None:
            yield from _place(source.surface, f"sources.{name}.surface", machine, whole=True, ends=True)


def _films(machine: Machine) -> Iterator[Problem]:
    if not machine.films:
        yield Problem("no films", "films", "without a film no heat leaves the machine: add a [films.NAME]")
    owner: dict[str, str] = {}  # place -> the film that has its own area
    for name, film in machine.films.items():
        if film is None:
            continue
        where = f"films.{name}.surfaces"
        if film.area is not None and len(film.surfaces) != 1:
            remedy = "an area is that of one node or bar: make a film of each"
            yield Problem(f"'area' of a film of {len(film.surfaces)} surfaces", f"films.{name}.area", remedy)
        graded = _graded(film, machine)
        for place in film.surfaces:
            found = list(_place(place, where, machine, whole=True, ends=False))
            yield from found
            if found:
                continue
            if film.area is None:
                if not film.additional and owner.setdefault(place, name) != name:
                    remedy = 'give one of them its part of the area: area = "0.05 m^2"'
                    yield Problem(f"'{place}' is also in films.{owner[place]}, with its whole area", where, remedy)
                yield from _without_area(place, machine)
            node = machine.nodes.get(place)
            if graded and node is not None and node.position is None:
                remedy = "the air is warmer above: give position = [0, 0, 0.8]"
                yield Problem(f"node '{place}' has no height", f"nodes.{place}", remedy)


def _graded(film: description.Film, machine: Machine) -> bool:
    """Whether what a film exchanges heat with changes over the height."""
    around = (machine.environment.get(film.environment), machine.environment.get(film.radiant or ""))
    return any(e is not None and e.gradient != 0 for e in around)


def _without_area(place: str, machine: Machine) -> Iterator[Problem]:
    node, bar = machine.nodes.get(place), machine.bars.get(place)
    if node is not None and node.area is None:
        yield Problem(f"node '{place}' has a film but no area", f"nodes.{place}", 'add area = "0.1 m^2"')
    if bar is not None and bar.perimeter is None:
        remedy = 'add perimeter = "100 mm"'
        yield Problem(f"bar '{place}' has a film but no perimeter", f"bars.{place}", remedy)


def _sensors(machine: Machine) -> Iterator[Problem]:
    for name, sensor in machine.sensors.items():
        if sensor is None or sensor.part is None:
            continue
        where = f"sensors.{name}"
        found = list(_place(sensor.part, f"{where}.part", machine, whole=True, ends=True))
        yield from found
        if found:
            continue
        if sensor.part in machine.bars and sensor.position is None:
            remedy = f"write position = [0.1, 0.2, 0.3], at axis positions zero, or part = '{sensor.part}.start'"
            yield Problem("a sensor on a bar without a position", where, remedy)
        if sensor.part not in machine.bars and sensor.position is not None:
            yield Problem("a position of one temperature", f"{where}.position", "remove it: a node has no inside")


def _tcp(machine: Machine) -> Iterator[Problem]:
    if machine.tcp is None:
        return
    for side in ("tool", "work"):
        if side in machine.tcp.model_fields_set:
            remedy = "a lumped machine has no surfaces: give [tcp.expansion] and [tcp.screws]"
            yield Problem("a side of the TCP of a lumped machine", f"tcp.{side}", remedy)
    for place in machine.tcp.expansion:
        yield from _place(place, f"tcp.expansion.{place}", machine, whole=True, ends=False)
    for name in machine.tcp.screws:
        where = f"tcp.screws.{name}"
        found = list(_place(name, where, machine, whole=True, ends=False, nodes=False))
        yield from found
        pairs = [pair for c in machine.contacts.values() if c is not None for pair in c.pairs]
        nuts = [pad for rail, pad in pairs if rail == name]
        astray = any(rail not in machine.bars for rail, _ in pairs) or None in machine.contacts.values()
        if not found and not astray and len(nuts) != 1:
            remedy = "give one moving contact with the one pair of screw and nut"
            yield Problem(f"{len(nuts) or 'no'} nuts run on screw '{name}'", where, remedy)
        material = machine.bars[name].material if machine.bars.get(name) is not None else ""
        if (entry := machine.materials.get(material)) is not None and "expansion" not in entry.model_fields_set:
            remedy = f"screw '{name}' is made of it: write expansion = \"11.5e-6 1/K\""
            yield Problem("missing key 'expansion'", f"materials.{material}.expansion", remedy)


def bodies_without_film(machine: Machine, bodies: Iterable[tuple[str, ...]]) -> Iterator[Problem]:
    """Bodies (their members) that no film cools: they have no steady temperature of their own."""
    films = [film for film in machine.films.values() if film is not None and not film.additional]
    cooled = {place for film in films for place in film.surfaces}
    for members in bodies:
        if not cooled & set(members):
            shown = ", ".join(members[:6]) + (" ..." if len(members) > 6 else "")
            place = f"{'nodes' if members[0] in machine.nodes else 'bars'}.{members[0]}"
            remedy = "join it by a fixed contact to what has a film, or put it into a film: nothing is insulated wholly"
            yield Problem(f"no film cools {shown}", place, remedy)


def joint_law_problems(machine: Machine) -> Iterator[Problem]:
    """Problems of the joint laws of fixed contacts."""
    for name, contact in machine.contacts.items():
        if contact is not None and contact.joint is not None and contact.total is None and contact.conductance is None:
            try:
                wiring.joint_conductance(name, machine)
            except TwinError as e:
                yield from e.problems
