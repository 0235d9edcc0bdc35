"""The content of the page of a description, as JSON: geometry, what moves it, the list, what is uncovered."""

from __future__ import annotations

from typing import Any

import numpy as np

from twin.machine.bodies import Body, bodies_of, owner_of
from twin.machine.description import Machine
from twin.machine.kinematics import direction, displacement, linear_axes
from twin.machine.turning import pieces_of, standing_axes, turning_axes
from twin.machine.wiring import signal
from twin.page.creases import creases
from twin.page.packed import packed
from twin.pictures.network import layout
from twin.show.entries import Entry, entries, square
from twin.show.surface import NamedSurface, Surfaces, named_surfaces

VERSION = 1  # of the content


def described_told(machine: Machine) -> dict[str, Any]:
    """A machine as JSON; lengths in m. Its meshes are read and nothing is assembled.

    Raises DescriptionError for meshes that cannot be read, axes that move both sides of a guide or supported bodies,
    laws that lack something.
    """
    surfaces = None if machine.lumped else named_surfaces(machine)
    listed = entries(machine, surfaces)
    bare = uncovered(surfaces) if surfaces else []
    return {
        "version": VERSION,
        "mode": "described",
        "title": f"{machine.machine.name}: as described",
        "subtitle": machine.machine.description,
        "vertical": "xyz".index(machine.machine.vertical),
        "facts": _facts(machine, surfaces, listed),
        "notes": _notes(machine, surfaces),
        "uncovered": [line for line, _ in bare],
        "problems": [str(p) for p in surfaces.problems] if surfaces else [],
        "axes": [] if surfaces is None else _axes(machine),
        "surface": None if surfaces is None else _surface(machine, surfaces),
        "network": _network(machine) if surfaces is None else None,
        "entries": [
            *(_uncovered_entry(part, line, surfaces) for line, part in bare if surfaces),
            *(_entry(machine, e, surfaces) for e in listed),
        ],
    }


def uncovered(surfaces: Surfaces) -> list[tuple[str, str]]:
    """Of every part with facets that no film and no contact covers: their area in words, and the part's name."""
    found = []
    for part in dict.fromkeys(s.part for s in surfaces.named):
        bare = [s for s in surfaces.named if s.part == part and s.uncovered]
        if bare:
            reasons = dict.fromkeys(s.why for s in bare)
            told = "; ".join(f"{', '.join(s.name for s in bare if s.why == why)} {why}" for why in reasons)
            area = square(sum(s.uncovered for s in bare))
            found.append((f"uncovered: {area} of {part}, adiabatic ({told})", part))
    return found


def _facts(machine: Machine, surfaces: Surfaces | None, listed: list[Entry]) -> list[str]:
    counts = {group: sum(e.group == group for e in listed) for group in dict.fromkeys(e.group for e in listed)}
    told = [f"{group.lower()}: {count}" for group, count in counts.items() if group != "Tool and work"]
    return [f"bodies: {len(bodies_of(machine))}", *([f"parts: {len(machine.parts)}"] if surfaces else []), *told]


def _notes(machine: Machine, surfaces: Surfaces | None) -> list[str]:
    """What is not drawn, and why."""
    notes = []
    if surfaces is None:
        notes.append("lumped machine: it has no meshes, so its network of nodes and bars is drawn")
    elif machine.nodes:
        notes.append(f"nodes beside parts have no surface and are in the list only: {', '.join(machine.nodes)}")
    for name, why in standing_axes(machine).items():
        notes.append(f"rotary axis {name} turns nothing here, as in the structure: {why}")
    if surfaces is not None and machine.sensors:
        air = [name for name, s in machine.sensors.items() if s.environment]
        notes += [f"sensors in the air are in the list only: {', '.join(air)}"] if air else []
    return notes


def _pieces(machine: Machine) -> tuple[Body, ...]:
    """Bodies, cut where rotary axes turn parts of them: what moves as a whole."""
    turning = turning_axes(machine)
    return tuple(piece for body in bodies_of(machine) for piece in pieces_of(body, turning))


def _axes(machine: Machine) -> list[dict[str, Any]]:
    """Linear axes: stroke [m] and how each piece moves with them, m/m. Then those that turn: stroke [rad] and which
    pieces, the inner before the outer."""
    pieces, found = _pieces(machine), []
    for axis in linear_axes(machine):
        moves = [displacement(machine, piece.name, {axis: 1.0}).tolist() for piece in pieces]
        found.append({"name": axis, "stroke": list(machine.axes[axis].stroke), "moves": moves})
    for t in turning_axes(machine):
        entry = machine.axes[t.axis]
        angle = signal(entry.position, machine.signals[entry.position])
        turns = [set(piece.parts) <= set(t.parts) for piece in pieces]
        along = {"point": list(entry.point or ()), "direction": direction(machine, t.axis).tolist()}
        found.append({"name": t.axis, "stroke": [angle.low, angle.high], "turns": turns, **along})
    return found


def _surface(machine: Machine, surfaces: Surfaces) -> dict[str, Any]:
    """Points (n, 3) m body by body, triangles and edges into them, and of each triangle its surface and bare share."""
    points: list[np.ndarray] = []
    triangles: list[np.ndarray] = []
    edges: list[np.ndarray] = []
    count = 0
    for s in surfaces.named:
        own, inverse = np.unique(s.corners.reshape(-1, 3), axis=0, return_inverse=True)
        corners = inverse.reshape(-1, 3)
        points.append(own)
        triangles.append(corners + count)
        edges.append(creases(own, corners) + count)  # surface by surface: its border is drawn, too
        count += len(own)

    def each(values: list[int], of: list[np.ndarray]) -> np.ndarray:
        return np.repeat(values, [len(k) for k in of])

    pieces = _pieces(machine)
    numbers, bodies = list(range(len(surfaces.named))), [_place_of(pieces, s.part) for s in surfaces.named]
    return {
        "bodies": [piece.name for piece in pieces],
        "names": [s.path for s in surfaces.named],
        "points": packed(np.vstack(points)),
        "body": packed(each(bodies, points), "u4"),  # of each point
        "triangles": packed(np.vstack(triangles), "u4"),
        "of": packed(each(numbers, triangles), "u4"),
        "bare": packed(np.concatenate([_drawn_bare(s) for s in surfaces.named])),
        "edges": packed(np.vstack(edges), "u4"),
    }


def _place_of(pieces: tuple[Body, ...], part: str) -> int:
    return next(i for i, piece in enumerate(pieces) if part in piece.parts)


def _drawn_bare(s: NamedSurface) -> np.ndarray:
    return s.bare if s.uncovered else np.zeros_like(s.bare)


def _network(machine: Machine) -> dict[str, Any]:
    """Nodes, bars and what joins them, with their places on paper."""
    names = list(machine.members)
    links = [
        (owner_of(a), owner_of(b), contact.kind == "moving")
        for contact in machine.contacts.values()
        for a, b in ([contact.surfaces] if contact.surfaces else contact.pairs)
    ]
    pairs = [(names.index(a), names.index(b)) for a, b, _ in links]
    return {
        "names": names,
        "bars": [name in machine.bars for name in names],
        "places": layout(len(names), pairs).tolist(),
        "links": [[*pair, moves] for pair, (_, _, moves) in zip(pairs, links, strict=True)],
    }


def _entry(machine: Machine, e: Entry, surfaces: Surfaces | None) -> dict[str, Any]:
    if surfaces is None:
        names = list(machine.members)
        places = [names.index(owner_of(p)) for p in e.places if owner_of(p) in names]
        return _told(e.group, e.name, e.path, e.facts, places)
    body = _place_of(_pieces(machine), e.on) if e.on in machine.parts else None
    point = None if e.point is None or body is None else {"at": list(e.point), "body": body}
    return _told(e.group, e.name, e.path, e.facts, surfaces.numbers(*e.places), point)


def _uncovered_entry(part: str, line: str, surfaces: Surfaces) -> dict[str, Any]:
    own = [s for s in surfaces.named if s.part == part and s.uncovered]
    facts = [(s.name, f"{square(s.uncovered)} of {square(s.area)}: {s.why}") for s in own]
    return _told("Uncovered", part, line, facts, surfaces.numbers(*(s.path for s in own)))


def _told(
    group: str,
    name: str,
    path: str,
    facts: list[tuple[str, str]],
    places: list[int],
    point: dict[str, Any] | None = None,
) -> dict[str, Any]:
    return {"group": group, "name": name, "path": path, "facts": facts, "places": places, "point": point}
