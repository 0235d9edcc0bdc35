"""The machine as the picture of a diagnosis shows it: surfaces or nodes, sensors, and what of them a place is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.build.mesh import load_body_meshes
from twin.build.places import Place
from twin.build.surface import facet_nodes
from twin.diagnose.model.probed_model import ProbedModel
from twin.diagnose.result.place import Network, Scene, Shell
from twin.diagnose.result.spot import Of, Spot
from twin.machine.description import Machine


def scene_of(machine: Machine, probed: ProbedModel, place: str, surface: str = "") -> Scene:
    """The scene of a place of a cause; surface: another one that it names, as a misplaced source does."""
    marked = dict.fromkeys(
        [*_located(machine, probed, place), *(_located(machine, probed, surface) if surface else ())]
    )
    vertical = "xyz".index(machine.machine.vertical)
    if machine.lumped:
        known = [m for m in marked if m in (*machine.nodes, *machine.bars)]
        on = {n: s.part.partition(".")[0] for n, s in machine.sensors.items() if s.part is not None}
        return Scene(_network(machine), vertical, tuple(known), on, place)
    where = {n: tuple(map(float, s.position)) for n, s in machine.sensors.items() if s.part and s.position}
    return Scene(_shell(machine), vertical, tuple(marked), where, place)  # type: ignore[arg-type]


def _located(machine: Machine, probed: ProbedModel, place: str) -> list[str]:
    """Surfaces ("bed.left") or nodes that a place of a cause is, by the names of the description; a sensor is told by
    its marker, and what is measured or logged has no place."""
    places = {p.name: p for p in probed.places}
    load = probed.base.load_model
    spot = Spot.read(place)
    of, name = spot.of, spot.name
    if place in places:
        return _surfaces([places[place]])
    if spot.between:
        return [m for side in (name, spot.partner) for m in _located(machine, probed, side)]
    if of is Of.FILM:
        return _surfaces([p for p in places.values() if p.film == name])
    if of is Of.CONTACT and name in machine.contacts:
        contact = machine.contacts[name]
        named = [*(contact.surfaces or ()), *(s for pair in contact.pairs for s in pair)]
        return [_known(machine, s) for s in named]
    if of is Of.SOURCE and name in machine.sources:
        source = machine.sources[name]
        if source.contact:
            return _located(machine, probed, f"contacts.{source.contact}")
        return [_known(machine, str(source.surface))]
    if of is Of.SIGNAL:
        read = [s.name for s in load.sources if name in s.use.signals.values()]
        return [m for s in read for m in _located(machine, probed, f"sources.{s}")]
    if of is Of.ENVIRONMENT:
        films = [f.name for f in load.films if load.environments[f.environment].name == name]
        return _surfaces([p for p in places.values() if p.film in films])
    return _surfaces([p for p in places.values() if spot.member in p.members])


def _surfaces(places: Sequence[Place]) -> list[str]:
    return [".".join(s) for p in places for s in p.surfaces] or [p.name for p in places]


def _known(machine: Machine, name: str) -> str:
    """Of nodes and bars without the end that a contact names."""
    return name.partition(".")[0] if machine.lumped else name


def _shell(machine: Machine) -> Shell:
    points, triangles, parts, surfaces, names = [], [], [], [], list[str]()
    first = 0
    for n, part in enumerate(part for body in load_body_meshes(machine) for part in body.parts):
        for name in part.surfaces:
            own = facet_nodes(part, part.facets(name))[:, :3] + first
            triangles.append(own)
            parts.append(np.full(len(own), n))
            surfaces.append(np.full(len(own), len(names)))
            names.append(f"{part.name}.{name}")
        points.append(part.nodes)
        first += part.n
    return Shell(np.vstack(points), np.vstack(triangles), np.concatenate(parts), np.concatenate(surfaces), tuple(names))


def _network(machine: Machine) -> Network:
    nodes = (*machine.nodes, *machine.bars)
    links = []
    for contact in machine.contacts.values():
        for a, b in [tuple(contact.surfaces)] if contact.surfaces else contact.pairs:
            links.append((a.partition(".")[0], b.partition(".")[0], not contact.surfaces))
    return Network(nodes, tuple(machine.bars), tuple(dict.fromkeys(links)))
