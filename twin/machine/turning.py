"""Rotary axes in the structure: which parts of a body an axis turns, and about which bearing.

A rotary axis turns parts of a body, not the whole of it: the body is cut at the fixed contacts between what the axis
carries and what stands on guides or supports. These contacts are its bearing. They pass heat as drawn whatever the
angle, as if a bearing's rings were as warm all round.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from twin.machine.bodies import Body, bodies_of, body_of, owner_of
from twin.machine.description import Axis, Machine


@dataclass(frozen=True)
class Turning:
    """A rotary axis that turns the tool or the work."""

    axis: str
    body: str
    parts: tuple[str, ...]  # that turn
    bearing: tuple[str, ...]  # fixed contacts
    surfaces: tuple[tuple[str, str], ...]  # of each: "part.surface" that it turns on, and the one that turns
    sign: int  # 1: it turns the tool, -1: the work


def turning_axes(machine: Machine) -> tuple[Turning, ...]:
    """Those of a machine of parts with a TCP: of the tool, then of the work, each from the guides outwards."""
    found = [t for name in _rotary(machine) if isinstance(t := _turning(machine, name), Turning)]
    found.sort(key=lambda t: (-t.sign, -len(t.parts)))
    return tuple(t for k, t in enumerate(found) if not any(t.parts == other.parts for other in found[:k]))


def standing_axes(machine: Machine) -> dict[str, str]:
    """Rotary axes that turn nothing in the structure, and why."""
    turn = {t.axis for t in turning_axes(machine)}
    reasons = {name: _turning(machine, name) for name in _rotary(machine) if name not in turn}
    return {n: r if isinstance(r, str) else "another axis turns the same parts" for n, r in reasons.items()}


def pieces_of(body: Body, turning: tuple[Turning, ...]) -> tuple[Body, ...]:
    """A body cut at the bearings of the axes that turn parts of it."""
    groups: dict[frozenset[str], list[str]] = {}
    for part in body.parts:
        groups.setdefault(frozenset(t.axis for t in turning if part in t.parts), []).append(part)
    return tuple(Body(parts[0], tuple(parts)) for parts in groups.values())


def _rotary(machine: Machine) -> tuple[str, ...]:
    return tuple(name for name, axis in machine.axes.items() if axis.kind == "rotary")


def _turning(machine: Machine, name: str) -> Turning | str:
    """What an axis turns, or why it turns nothing."""
    if machine.lumped or not machine.has_tcp:
        return "only a machine of parts with a TCP has a structure that turns"
    axis = machine.axes[name]
    if axis.point is None:
        return "no `point` says where it lies"
    bodies = bodies_of(machine)
    if len({body_of(bodies, part).name for part in axis.carries}) > 1:
        return "it carries parts of several bodies"
    body = body_of(bodies, axis.carries[0])
    held = {part for part in _held(machine) if part in body.parts}
    standing = _reached(machine, body, next((part for part in body.parts if part in held), ""), axis)
    if not held <= standing:
        return "guides, supports or a scale stand on what it carries, and would have to turn, too"
    parts = tuple(part for part in body.parts if part not in standing)
    joints = _bearing(machine, standing, parts)
    if not joints:
        return "no fixed contact joins what it carries to a part that it turns on"
    tool, work = (owner_of(side.surface) in parts for side in (machine.tcp.tool, machine.tcp.work))
    if tool == work:
        return "it turns the tool and the work alike" if tool else "it turns neither the tool nor the work"
    return Turning(name, body.name, parts, tuple(joints), tuple(joints.values()), 1 if tool else -1)


def _bearing(machine: Machine, standing: set[str], turned: tuple[str, ...]) -> dict[str, tuple[str, str]]:
    """Fixed contacts between parts that stand and parts that turn: the surface that stands first."""
    found = {}
    for contact, pair in _glued(machine):
        for a, b in (pair, pair[::-1]):
            if owner_of(a) in standing and owner_of(b) in turned:
                found[contact] = (a, b)
    return found


def _glued(machine: Machine) -> Iterator[tuple[str, tuple[str, str]]]:
    """Contacts whose surfaces lie on each other and move as one."""
    for name, contact in machine.contacts.items():
        if contact.glues and contact.surfaces is not None:
            yield name, contact.surfaces


def _held(machine: Machine) -> Iterator[str]:
    """Parts that springs or scales take hold of."""
    for contact in machine.contacts.values():
        for pair in contact.pairs:
            yield from map(owner_of, pair)
    for support in machine.supports.values():
        yield owner_of(support.surface)
    for axis in machine.axes.values():
        yield from (owner_of(s) for s in (axis.encoder.scale, axis.encoder.reader) if s is not None)


def _reached(machine: Machine, body: Body, held: str, axis: Axis) -> set[str]:
    """Parts of a body that fixed contacts join to one that is held, not by way of what the axis carries."""
    reached = {held} - set(axis.carries)
    while True:
        more = {
            owner_of(far)
            for _, pair in _glued(machine)
            for near, far in (pair, pair[::-1])
            if owner_of(near) in reached and owner_of(far) in body.parts
        } - set(axis.carries)
        if more <= reached:
            return reached
        reached |= more
