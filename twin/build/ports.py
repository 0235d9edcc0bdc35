"""Ports of moving contacts: the segments of rails and screws, and the pads (carriages, nuts) that run on them.

A rail is cut into segments of equal length, each a port whose station is its exact centroid along the axis; pads see
the rail by interpolation between neighbouring stations (eq (1) of paper 000, `twin.rom.contact`). Linear fields are
thus reproduced exactly at any position. Heat and forces share these patches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.build.mesh import BodyMesh, PartMesh
from twin.build.surface import Patch, patch, segments
from twin.errors import DescriptionError, Problem, TwinError
from twin.machine.bodies import split_surface
from twin.machine.description import Contact, Machine
from twin.machine.kinematics import direction, linear_axes, rail_moves
from twin.machine.wiring import joint_conductance
from twin.rom.load_model import Pair, Rail


@dataclass(frozen=True)
class ContactPorts:
    """All ports of a machine, numbered as in LoadModel.ports."""

    names: tuple[str, ...]  # "rail_1.top[0]" for segments, "pad_1.bottom" for pads
    parts: tuple[str, ...]  # part of each port
    patches: tuple[Patch, ...]
    rails: tuple[Rail, ...]
    pairs: tuple[Pair, ...]


def contact_ports(machine: Machine, bodies: tuple[BodyMesh, ...]) -> ContactPorts:
    """Patches, stations and pairs of all moving contacts.

    Raises DescriptionError (all at once): unknown axis or surface, a rail with differing axes or segments, fewer than
    two segments, pads on the same side of the axis as their rail.
    """
    axes = linear_axes(machine)
    names: list[str] = []
    parts: list[str] = []
    patches: list[Patch] = []
    rails: list[Rail] = []
    pairs: list[Pair] = []
    cut: dict[str, tuple[int, str, int]] = {}  # rail surface -> (rail, axis, segments)
    pads: dict[str, int] = {}
    problems: list[Problem] = []

    def add(name: str, part: str, p: Patch) -> int:
        names.append(name)
        parts.append(part)
        patches.append(p)
        return len(names) - 1

    def add_rail(surface: str, contact: Contact, where: str) -> int:
        axis = _axis(contact, axes, where)
        if surface in cut:
            number, *same = cut[surface]
            if same != [axis, contact.segments]:
                raise DescriptionError(
                    f"rail '{surface}' has {same[1]} segments along '{same[0]}' and {contact.segments} along '{axis}'",
                    where,
                    "one rail surface belongs to one axis and is divided once",
                )
            return number
        if contact.segments < 2:
            raise DescriptionError("a rail needs at least 2 segments", f"{where}.segments", "12 suits most rails")
        along = direction(machine, axis)
        part, name = find_part(bodies, surface, where)
        found = segments(part, part.facets(name), along, contact.segments)
        ports = [add(f"{surface}[{i}]", part.name, p) for i, p in enumerate(found)]
        rails.append(Rail(surface, ports[0], tuple(float(p.centroid @ along) for p in found)))
        cut[surface] = (len(rails) - 1, axis, contact.segments)
        return len(rails) - 1

    def add_pad(surface: str, where: str) -> int:
        if surface not in pads:
            part, name = find_part(bodies, surface, where)
            pads[surface] = add(surface, part.name, patch(part, part.facets(name)))
        return pads[surface]

    for contact_name, contact in machine.contacts.items():
        where = f"contacts.{contact_name}"
        for rail, pad in contact.pairs if contact.kind == "moving" else ():
            try:
                axis = _axis(contact, axes, where)
                moves = rail_moves(machine, axis, rail, pad)
                number, port = add_rail(rail, contact, where), add_pad(pad, where)
            except TwinError as e:
                problems += [p for p in e.problems if p not in problems]
                continue
            switch, switched = switch_of(contact)
            pairs.append(
                Pair(
                    contact=contact_name,
                    axis=axes.index(axis),
                    rail=number,
                    pad_port=port,
                    station=float(patches[port].centroid @ direction(machine, axis)),
                    rail_moves=moves,
                    area=patches[port].area,
                    conductance=joint_conductance(contact_name, machine),
                    assignment=contact.assignment,
                    switch=switch,
                    switched=switched,
                )
            )
    if problems:
        raise DescriptionError.collect(problems)
    return ContactPorts(tuple(names), tuple(parts), tuple(patches), tuple(rails), tuple(pairs))


def switch_of(contact: Contact) -> tuple[str, float]:
    """The signal that switches a contact's conductance and the factor where it is 1: "" and 1 where nothing does."""
    return contact.switch or "", 1.0 if contact.switched is None else contact.switched


def find_part(bodies: tuple[BodyMesh, ...], surface: str, where: str) -> tuple[PartMesh, str]:
    """The part mesh and the surface name of "part.surface". Raises DescriptionError for an unknown part."""
    part_name, name = split_surface(surface)
    for body in bodies:
        for part in body.parts:
            if part.name == part_name:
                return part, name
    known = ", ".join(p.name for b in bodies for p in b.parts)
    raise DescriptionError(f"unknown part in '{surface}'", where, f"parts are: {known}")


def port_averages(body: BodyMesh, ports: ContactPorts) -> tuple[np.ndarray, tuple[int, ...]]:
    """Averages P (body.n, k) of the ports on a body, and their k numbers."""
    own = {p.name for p in body.parts}
    numbers = tuple(i for i, part in enumerate(ports.parts) if part in own)
    P = np.zeros((body.n, len(numbers)))
    for column, i in enumerate(numbers):
        P[ports.patches[i].nodes + body.part(ports.parts[i])[1], column] = ports.patches[i].mean
    return P, numbers


def _axis(contact: Contact, axes: tuple[str, ...], where: str) -> str:
    if contact.axis is None or contact.axis not in axes:
        raise DescriptionError(
            f"'{contact.axis}' is not a linear axis", f"{where}.axis", f"linear axes are: {', '.join(axes) or 'none'}"
        )
    return contact.axis
