"""The thermal model of a lumped machine: bodies of nodes and bars in the same affine form as meshes give.

Every element of a bar that carries a moving contact is a port, its station the element's middle: what runs on it is
treated as on a meshed rail, and everything downstream (drive, stepper, reduction, artefact, runtime) is the same.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp

from twin.build.lumped_body import (
    LumpedBody,
    at,
    capacity,
    conduction,
    film_areas,
    heights,
    lumped_body,
    mean,
    row,
    unit,
)
from twin.build.ports import ContactPorts, switch_of
from twin.build.terms import Term, columns, joint_term
from twin.build.thermal import machine_model
from twin.build.wiring import load_model
from twin.errors import DescriptionError
from twin.machine.bodies import bodies_of, owner_of
from twin.machine.check_lumped import film_area
from twin.machine.description import Contact, Machine
from twin.machine.kinematics import direction, linear_axes, rail_moves
from twin.machine.references import reference_problems
from twin.rom.load_model import LoadModel, Pair, Rail
from twin.rom.model import AffineBody, MachineModel


def lumped_bodies(machine: Machine) -> tuple[LumpedBody, ...]:
    """Nodes and bars that fixed contacts join, numbered."""
    return tuple(lumped_body(machine, body) for body in bodies_of(machine))


def assemble_lumped(machine: Machine, bodies: tuple[LumpedBody, ...]) -> MachineModel:
    """The full thermal model of a lumped machine; G stays empty.

    Raises DescriptionError with the problems of the description, and for film laws without positive values.
    """
    wrong = [p for p in reference_problems(machine) if not p.warning]  # none after load_machine
    if wrong:
        raise DescriptionError.collect(wrong)
    ports = lumped_ports(machine)
    areas = {
        name: sum(film_area(machine, film, place) for place in film.surfaces) for name, film in machine.films.items()
    }
    load = load_model(machine, ports, areas)
    return machine_model(machine, load, tuple(_body(machine, body, ports, load) for body in bodies))


def lumped_ports(machine: Machine) -> ContactPorts:
    """Elements of bars and the nodes that run on them; there are no patches.

    Stations increase along the axis, whichever way the bar points.
    """
    axes = linear_axes(machine)
    names: list[str] = []
    parts: list[str] = []
    rails: list[Rail] = []
    pairs: list[Pair] = []
    known: dict[str, int] = {}  # bar -> rail, node -> port
    for contact_name, contact in machine.contacts.items():
        for bar_name, node_name in contact.pairs:
            axis = str(contact.axis)
            along = direction(machine, axis)
            if bar_name not in known:
                known[bar_name] = len(rails)
                rails.append(Rail(bar_name, len(names), stations(machine, bar_name, along)))
                names += [f"{bar_name}[{i}]" for i in range(machine.bars[bar_name].elements)]
                parts += [bar_name] * machine.bars[bar_name].elements
            if node_name not in known:
                known[node_name] = len(names)
                names.append(node_name)
                parts.append(node_name)
            area, conductance = pair_conductance(contact)
            switch, switched = switch_of(contact)
            pairs.append(
                Pair(
                    contact=contact_name,
                    axis=axes.index(axis),
                    rail=known[bar_name],
                    pad_port=known[node_name],
                    station=float(np.asarray(machine.nodes[node_name].position) @ along),
                    rail_moves=rail_moves(machine, axis, bar_name, node_name),
                    area=area,
                    conductance=conductance,
                    assignment=contact.assignment,
                    key="conductance" if contact.total is None else "total",
                    switch=switch,
                    switched=switched,
                )
            )
    return ContactPorts(tuple(names), tuple(parts), (), tuple(rails), tuple(pairs))


def pair_conductance(contact: Contact) -> tuple[float, float]:
    """Area [m^2] and conductance [W/(m^2 K)] of each pair; of a total [W/K] taken as that of one square metre."""
    if contact.total is not None:
        return 1.0, contact.total
    return float(contact.area or 0.0), float(contact.conductance or 0.0)


def stations(machine: Machine, bar_name: str, along: np.ndarray) -> tuple[float, ...]:
    """Middles of a bar's elements [m] along an axis at position zero, increasing."""
    bar = machine.bars[bar_name]
    middles = (np.arange(bar.elements) + 0.5) * bar.length / bar.elements
    return tuple(sorted(float(s) for s in np.asarray(bar.origin) @ along + middles * (unit(bar) @ along)))


def _body(machine: Machine, body: LumpedBody, ports: ContactPorts, load: LoadModel) -> AffineBody:
    capacities = np.concatenate([capacity(machine, member) for member in body.members])
    terms = [*_film_terms(machine, body, load), *_joint_terms(machine, body, load)]
    heated = {i: place for i, s in enumerate(load.sources) if (place := machine.sources[s.name].surface) is not None}
    B = {i: row(machine, body, place) for i, place in heated.items() if place in body}
    P = {i: _port(machine, body, ports, i) for i, owner in enumerate(ports.parts) if owner in body}
    rows = _sensor_rows(machine, body)
    structural = [name for name, s in machine.sensors.items() if s.environment is None]
    graded = any(e.gradient != 0.0 for e in load.environments)
    return AffineBody(
        name=body.name,
        E=sp.csr_array(sp.diags_array(capacities)),
        A0=conduction(machine, body),
        A=tuple(t.matrix for t in terms),
        theta=tuple(t.coefficient for t in terms),
        M=columns([t.area for t in terms], body.n),
        B=columns(list(B.values()), body.n),
        sources=tuple(B),
        P=columns(list(P.values()), body.n),
        ports=tuple(P),
        C=np.array(list(rows.values())).reshape(-1, body.n),
        sensors=tuple(structural.index(name) for name in rows),
        G=np.zeros((0, 3, body.n)),
        one=np.ones(body.n),
        energy=capacities,
        H=columns([t.moment for t in terms], body.n) if graded else None,
        members=body.members,
        first=body.first,
    )


def _film_terms(machine: Machine, body: LumpedBody, load: LoadModel) -> Iterator[Term]:
    height = heights(machine, body)
    for k, film in enumerate(load.films):
        areas = film_areas(machine, machine.films[film.name], body)
        if areas.any():
            yield Term(k, sp.csr_array(sp.diags_array(areas)), areas, areas * height)


def _joint_terms(machine: Machine, body: LumpedBody, load: LoadModel) -> Iterator[Term]:
    for j, joint in enumerate(load.joints):
        contact = machine.contacts[joint.name]
        if contact.surfaces is not None and contact.surfaces[0] in body:
            gap = row(machine, body, contact.surfaces[0]) - row(machine, body, contact.surfaces[1])
            # a total [W/K] is the coefficient itself
            area = 1.0 if contact.total is not None else float(contact.area or 0.0)
            yield joint_term(len(load.films) + j, sp.csr_array(np.outer(gap, gap)) * area)


def _sensor_rows(machine: Machine, body: LumpedBody) -> dict[str, np.ndarray]:
    """Weights (n,) of every sensor on the body."""
    rows = {}
    for name, sensor in machine.sensors.items():
        if sensor.part is not None and sensor.part in body:
            bar = machine.bars.get(sensor.part)
            weights = at(bar, np.asarray(sensor.position)) if bar and sensor.position else mean(machine, sensor.part)
            rows[name] = row(machine, body, sensor.part, weights)
    return rows


def _port(machine: Machine, body: LumpedBody, ports: ContactPorts, number: int) -> np.ndarray:
    """Weights (n,) of a port: the two borders of an element, or a node."""
    owner = ports.parts[number]
    if owner in machine.nodes:
        return row(machine, body, owner)
    bar = machine.bars[owner]
    rail, along = next((r, _along(machine, owner)) for r in ports.rails if r.name == owner)
    element = number - rail.first_port
    if unit(bar) @ along < 0:  # stations count along the axis
        element = bar.elements - 1 - element
    weights = np.zeros(bar.elements + 1)
    weights[[element, element + 1]] = 0.5
    return row(machine, body, owner, weights)


def _along(machine: Machine, bar_name: str) -> np.ndarray:
    """Direction (3,) of the axis whose contact runs on a bar."""
    axis = next(c.axis for c in machine.contacts.values() for rail, _ in c.pairs if owner_of(rail) == bar_name)
    return direction(machine, str(axis))
