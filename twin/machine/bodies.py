"""Bodies: the parts (of a lumped machine the nodes and bars) that move and are factored as one, because fixed contacts
join them."""

from __future__ import annotations

from dataclasses import dataclass

from twin.errors import DescriptionError
from twin.machine.description import Machine, Tank

TANKS = "tanks."  # before the name of a tank: no part, node or bar has a dot in its name


@dataclass(frozen=True)
class Body:
    """Parts joined, directly or through others, by contacts of kind "fixed"."""

    name: str  # the first part's name
    parts: tuple[str, ...]  # or nodes and bars, in the order of the description


def split_surface(surface: str) -> tuple[str, str]:
    """ "bed.rail_top" as ("bed", "rail_top"); raises DescriptionError where the dot is missing."""
    part, dot, name = surface.partition(".")
    if not (part and dot and name):
        raise DescriptionError(
            f"'{surface}' is not a surface", "machine.toml", "write surfaces as 'part.surface', for example 'bed.top'"
        )
    return part, name


def owner_of(place: str) -> str:
    """The part of "part.surface", the bar of "bar.end", or the node or bar itself."""
    return place.partition(".")[0]


def joined(machine: Machine) -> frozenset[frozenset[str]]:
    """The parts, or nodes and bars, that a contact joins, by two."""
    sides = [pair for c in machine.contacts.values() for pair in (*([c.surfaces] if c.surfaces else ()), *c.pairs)]
    return frozenset(frozenset(map(owner_of, pair)) for pair in sides)


def tanks_on(machine: Machine, members: tuple[str, ...]) -> dict[str, Tank]:
    """The tanks on these parts, nodes or bars by the names they have as members of a body, "tanks.NAME"."""
    return {f"{TANKS}{name}": tank for name, tank in machine.tanks.items() if owner_of(tank.surface) in members}


def tank_of(machine: Machine, member: str) -> Tank | None:
    """The tank that a member of a body is, None of others."""
    return machine.tanks[member.removeprefix(TANKS)] if member.startswith(TANKS) else None


def bodies_of(machine: Machine) -> tuple[Body, ...]:
    """The bodies of a machine, ordered as their first parts appear.

    Raises DescriptionError where a fixed contact names an unknown part or has no two surfaces.
    """
    leader = {part: part for part in machine.members}  # disjoint sets; leaders are the earliest parts
    order = {part: i for i, part in enumerate(machine.members)}

    def find(part: str) -> str:
        while leader[part] != part:
            part = leader[part]
        return part

    for name, contact in machine.contacts.items():
        if contact.kind != "fixed":
            continue
        if contact.surfaces is None:
            remedy = "give surfaces = ['part.surface', 'part.surface']"
            raise DescriptionError("a fixed contact without surfaces", f"contacts.{name}", remedy)
        for surface in contact.surfaces:
            if owner_of(surface) not in leader:
                remedy = f"parts are: {', '.join(machine.members)}"
                raise DescriptionError(f"unknown part in '{surface}'", f"contacts.{name}.surfaces", remedy)
        a, b = (find(owner_of(s)) for s in contact.surfaces)
        first, second = sorted((a, b), key=order.__getitem__)
        leader[second] = first

    members: dict[str, list[str]] = {}
    for part in machine.members:
        members.setdefault(find(part), []).append(part)
    return tuple(Body(name, tuple(parts)) for name, parts in members.items())


def body_of(bodies: tuple[Body, ...], part: str) -> Body:
    """The body a part belongs to. Raises DescriptionError for an unknown part."""
    for body in bodies:
        if part in body.parts:
            return body
    known = ", ".join(p for b in bodies for p in b.parts)
    raise DescriptionError(f"unknown part '{part}'", "machine.toml", f"parts are: {known}")
