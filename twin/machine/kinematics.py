"""Rigid motion of the bodies with the linear axes.

An axis moves the bodies of the parts it carries and all that these carry in turn: the column carries the headstock
because the Y guides join them, so X moves both. Rotary axes turn parts of bodies: `twin.machine.turning`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from twin.errors import DescriptionError
from twin.machine.bodies import Body, bodies_of, body_of, owner_of
from twin.machine.description import Machine


def linear_axes(machine: Machine) -> tuple[str, ...]:
    """Names of the linear axes in the order of the description."""
    return tuple(name for name, axis in machine.axes.items() if axis.kind == "linear")


def direction(machine: Machine, axis: str) -> np.ndarray:
    """Unit direction (3,) of an axis. Raises DescriptionError for a zero direction."""
    d = np.asarray(machine.axes[axis].direction, dtype=float)
    length = np.linalg.norm(d)
    if not length > 0:
        raise DescriptionError("the direction has no length", f"axes.{axis}.direction", "give a vector like [1, 0, 0]")
    return d / length


def moving_contacts(machine: Machine, bodies: tuple[Body, ...]) -> tuple[tuple[str, str, str], ...]:
    """Every (axis, rail body, pad body) that a moving contact joins."""
    return tuple(
        (contact.axis, body_of(bodies, owner_of(rail)).name, body_of(bodies, owner_of(pad)).name)
        for contact in machine.contacts.values()
        if contact.kind == "moving" and contact.axis is not None
        for rail, pad in contact.pairs
    )


def moved_bodies(machine: Machine, axis: str) -> frozenset[str]:
    """Names of the bodies that a linear axis moves: what it carries, and all reached from there without this axis.

    Raises DescriptionError where the axis would move a supported body: then `carries` names the wrong side.
    """
    bodies = bodies_of(machine)
    joined = [(a, b) for name, a, b in moving_contacts(machine, bodies) if name != axis]
    moved = {body_of(bodies, part).name for part in machine.axes[axis].carries}
    frontier = set(moved)
    while frontier:
        reached = {b for a, b in joined if a in frontier} | {a for a, b in joined if b in frontier}
        frontier = reached - moved
        moved |= frontier
    for name, support in machine.supports.items():
        if body_of(bodies, owner_of(support.surface)).name in moved:
            raise DescriptionError(
                f"axis '{axis}' moves the body that stands on supports.{name}",
                f"axes.{axis}.carries",
                "list the parts on the far side of the guides, not those on the ground",
            )
    return frozenset(moved)


def rail_moves(machine: Machine, axis: str, rail: str, pad: str) -> bool:
    """Whether the rail ("part.surface"), not the pad, sits on the body that the axis moves.

    The pad's coordinate on the rail is then its station minus the position, else its station plus the position.
    Raises DescriptionError where the axis moves both or neither.
    """
    bodies = bodies_of(machine)
    moved = moved_bodies(machine, axis)
    of_rail, of_pad = (body_of(bodies, owner_of(s)).name in moved for s in (rail, pad))
    if of_rail == of_pad:
        raise DescriptionError(
            f"'{rail}' and '{pad}' {'both move' if of_rail else 'both stand still'} when axis '{axis}' moves",
            f"axes.{axis}.carries",
            "an axis carries exactly one side of its moving contacts; see also fixed contacts that join the two sides",
        )
    return of_rail


def displacement(machine: Machine, body_name: str, positions: Mapping[str, float]) -> np.ndarray:
    """Rigid translation (3,) [m] of a body (named by itself or any of its parts) at linear-axis positions [m].

    Axes not given stay at zero. Raises DescriptionError for an unknown body or axis.
    """
    body = body_of(bodies_of(machine), body_name).name
    known = linear_axes(machine)
    shift = np.zeros(3)
    for axis, position in positions.items():
        if axis not in known:
            remedy = f"linear axes are: {', '.join(known)}"
            raise DescriptionError(f"'{axis}' is not a linear axis", "positions", remedy)
        if body in moved_bodies(machine, axis):
            shift = shift + position * direction(machine, axis)
    return shift
