"""The TCP rows that the description of a lumped machine gives (`twin.rom.lumped_structure`)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.build.lumped_body import LumpedBody, borders, row, unit
from twin.build.scales import added_scale
from twin.errors import DescriptionError
from twin.machine.description import Machine, Scale
from twin.machine.kinematics import direction, linear_axes, rail_moves
from twin.machine.platform import geometry_of, struts_of
from twin.machine.tcp import Strut
from twin.rom.lumped_structure import LumpedStructure, Screw
from twin.rom.scales import AddedScale
from twin.rom.struts import Growth, Spread, StrutPlatform


def lumped_structure(machine: Machine, bodies: Sequence[LumpedBody]) -> LumpedStructure:
    """The TCP rows that a description gives.

    Raises DescriptionError for a screw without a nut, and where an axis moves both sides of a contact, or neither.
    """
    constant = []
    for body in bodies:
        rows = np.zeros((3, body.n))
        for place, per_kelvin in machine.tcp.expansion.items():
            if place in body:
                rows += np.outer(per_kelvin, row(machine, body, place))
        constant.append(rows)
    scales = tuple(_scale(machine, bodies, scale) for scale in machine.scales.values())
    axes = linear_axes(machine)
    if machine.tcp.platform is None:
        screws = tuple(_screw(machine, bodies, name, side) for name, side in machine.tcp.screws.items())
        return LumpedStructure(axes, tuple(constant), screws, scales)
    struts = struts_of(machine)
    screws = tuple(_screw(machine, bodies, strut.screw, "tool") for strut in struts)
    return LumpedStructure(axes, tuple(constant), screws, scales, _platform(machine, bodies, struts))


def _platform(machine: Machine, bodies: Sequence[LumpedBody], struts: Sequence[Strut]) -> StrutPlatform:
    platform = machine.tcp.platform
    assert platform is not None

    def states(place: str) -> tuple[int, np.ndarray, np.ndarray]:
        body = next(i for i, b in enumerate(bodies) if place in b)
        mean = row(machine, bodies[body], place)
        at = np.flatnonzero(mean)
        return body, at, mean[at]

    def growth(place: str, rate: float) -> Growth:
        body, at, mean = states(place)
        return Growth(body, at, rate * mean)

    def spread(place: str | None) -> Spread | None:
        if place is None:
            return None
        return Spread(*states(place), machine.materials[str(machine.nodes[place].material)].expansion)

    return StrutPlatform(
        geometry_of(machine),
        1.0 if platform.side == "tool" else -1.0,
        tuple(tuple(growth(*item) for item in strut.growth.items()) for strut in struts),
        spread(platform.moving),
        spread(platform.frame),
        np.array(platform.ground, dtype=float),
    )


def _scale(machine: Machine, bodies: Sequence[LumpedBody], scale: Scale) -> AddedScale:
    body = next(i for i, b in enumerate(bodies) if scale.surface in b)
    mean = row(machine, bodies[body], scale.surface)
    states = np.flatnonzero(mean)
    return added_scale(machine, scale, body, states, mean[states])


def _screw(machine: Machine, bodies: Sequence[LumpedBody], name: str, side: str) -> Screw:
    bar = machine.bars[name]
    nuts = [(str(c.axis), pad) for c in machine.contacts.values() for rail, pad in c.pairs if rail == name]
    if len(nuts) != 1:
        remedy = "give one moving contact with the one pair of screw and nut"
        raise DescriptionError(f"{len(nuts)} nuts run on screw '{name}'", f"tcp.screws.{name}", remedy)
    ((axis, nut),) = nuts
    along, d = direction(machine, axis), unit(bar)
    where = np.asarray(machine.nodes[nut].position, dtype=float) - np.asarray(bar.origin)
    body = next(i for i, b in enumerate(bodies) if name in b)
    return Screw(
        body=body,
        first=bodies[body].states(name, machine).start,
        borders=borders(bar),
        direction=d if side == "tool" else -d,
        expansion=machine.materials[bar.material].expansion,
        from_end=bar.fixed_end == "end",
        held_at_both=bar.fixed_end == "both",
        axis=linear_axes(machine).index(axis),
        nut=float(where @ d),
        per_position=float(np.sign(along @ d)) * (-1.0 if rail_moves(machine, axis, name, nut) else 1.0),
    )
