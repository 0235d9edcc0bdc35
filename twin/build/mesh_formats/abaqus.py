"""Abaqus input files (.inp), as Abaqus, CalculiX, PrePoMax, Salome and gmsh write them.

Faces have names in four ways, the first wins where several say the same: `*SURFACE`, `*ELSET` of shell or membrane
elements, the ELSET of such elements' own `*ELEMENT`, `*NSET` (all outer sides within it). Numbers of element sides and
orders of nodes: Abaqus Elements Guide, CalculiX ccx manual ("Element types").
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from twin.build.mesh_formats.solid_file import Array, SolidFile, Solids, from_numbers, outer_sides, sides_within

_SOLID = re.compile(r"(?:D|AC)?C3D(\d+)", re.I)
_FACE = re.compile(r"(?:CPS|CPE|CPEG|CAX|M3D|SFM3D|DS|DC2D|S|STRI|R3D)(\d)", re.I)
_SHAPES = {4: "tetra", 10: "tetra", 5: "pyramid", 13: "pyramid", 6: "wedge", 15: "wedge", 8: "hexahedron",
           20: "hexahedron"}  # fmt: skip
_SIDES = {
    "tetra": ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    "pyramid": ((0, 1, 2, 3), (0, 4, 1), (1, 4, 2), (2, 4, 3), (3, 4, 0)),
    "wedge": ((0, 1, 2), (3, 5, 4), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "hexahedron": ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
}


@dataclass
class _Elements:
    """One `*ELEMENT` block."""

    numbers: Array
    nodes: Array  # (m, k) numbers
    shape: str | None  # None: a face
    set_name: str | None


@dataclass
class _Input:
    """The file's blocks, names as first spelt; sets by their name in capitals, as Abaqus knows them."""

    numbers: list[Array] = field(default_factory=list)
    points: list[Array] = field(default_factory=list)
    elements: list[_Elements] = field(default_factory=list)
    types: list[str] = field(default_factory=list)
    spelt: dict[str, str] = field(default_factory=dict)
    element_sets: dict[str, list[str]] = field(default_factory=dict)  # numbers, or names of sets
    node_sets: dict[str, list[str]] = field(default_factory=dict)
    surfaces: dict[str, list[tuple[str, str]]] = field(default_factory=dict)  # (element or set, side)
    shift: Array = field(default_factory=lambda: np.zeros(3))


def read(path: Path) -> SolidFile:
    """Raises ValueError: several parts, a rotated instance, surfaces that are combined of others, broken numbers."""
    found = _Input()
    outside = False
    for keyword, options, rows in _blocks(path):
        if keyword == "PART":
            if found.numbers:
                raise ValueError("it holds several parts: export each into a file of its own")
        elif keyword == "END PART":
            outside = True
        elif keyword == "INSTANCE":
            found.shift = _shift(rows)
        elif keyword == "NODE" and not outside:  # nodes of an assembly are reference points
            _nodes(found, options, rows)
        elif keyword == "ELEMENT":
            _elements(found, options, rows)
        elif keyword in ("ELSET", "NSET"):
            sets = found.element_sets if keyword == "ELSET" else found.node_sets
            sets.setdefault(_name(found, options[keyword]), []).extend(_members(options, rows))
        elif keyword == "SURFACE":
            _surface(found, options, rows)
    return _solid_file(found)


def _blocks(path: Path) -> Iterator[tuple[str, dict[str, str], list[list[str]]]]:
    """(keyword, options, rows of fields) of every keyword line, files that are included among them."""
    keyword, options, rows = "", dict[str, str](), list[list[str]]()
    goes_on = ""
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        text = line.strip()
        if not text or text.startswith("**"):
            continue
        if not (text.startswith("*") or goes_on):
            rows.append([f.strip() for f in text.split(",") if f.strip()])
            continue
        text = goes_on + text
        goes_on = text if text.endswith(",") else ""
        if goes_on:
            continue
        if keyword:
            yield keyword, options, rows
        first, *rest = [f.strip() for f in text[1:].split(",")]
        keyword, rows = " ".join(first.upper().split()), []
        options = {k.strip().upper(): v.strip().strip('"') for k, _, v in (r.partition("=") for r in rest)}
        if keyword == "INCLUDE":
            inside = path.parent / options.get("INPUT", "")
            if not inside.is_file():
                raise ValueError(f"it includes '{options.get('INPUT', '')}', which is not beside it")
            yield from _blocks(inside)
    if keyword:
        yield keyword, options, rows


def _name(found: _Input, name: str) -> str:
    found.spelt.setdefault(name.upper(), name)
    return name.upper()


def _shift(rows: Sequence[Sequence[str]]) -> Array:
    if len(rows) > 1:
        raise ValueError("its part is rotated in the assembly: export the part itself, or without rotation")
    return np.array(rows[0], dtype=float) if rows else np.zeros(3)


def _nodes(found: _Input, options: dict[str, str], rows: Sequence[Sequence[str]]) -> None:
    if not rows:
        return
    table = np.array([(*row, *("0",) * (4 - len(row)))[:4] for row in rows], dtype=float)
    found.numbers.append(table[:, 0].astype(int))
    found.points.append(table[:, 1:])
    if "NSET" in options:
        found.node_sets.setdefault(_name(found, options["NSET"]), []).extend(row[0] for row in rows)


def _elements(found: _Input, options: dict[str, str], rows: Sequence[Sequence[str]]) -> None:
    kind = options.get("TYPE", "")
    found.types.append(kind)
    solid, face = _SOLID.match(kind), _FACE.match(kind)
    if solid is None and face is None:
        return
    digits = int((solid or face)[1])  # type: ignore[index]
    flat = np.array([f for row in rows for f in row], dtype=int)
    if len(flat) % (digits + 1):
        raise ValueError(f"an element of type {kind} has not {digits} nodes")
    table = flat.reshape(-1, digits + 1)
    if solid and digits not in _SHAPES:
        raise ValueError(f"elements of type {kind} are not known")
    shape = _SHAPES[digits] if solid else None
    corners = digits if solid else 3 if digits in (3, 6) else 4
    set_name = _name(found, options["ELSET"]) if "ELSET" in options else None
    found.elements.append(_Elements(table[:, 0], table[:, 1 : corners + 1], shape, set_name))


def _members(options: dict[str, str], rows: Sequence[Sequence[str]]) -> list[str]:
    if "GENERATE" not in options:
        return [f for row in rows for f in row]
    spans = [(int(r[0]), int(r[1]), int(r[2]) if len(r) > 2 else 1) for r in rows]
    return [str(i) for first, last, step in spans for i in range(first, last + 1, step)]


def _surface(found: _Input, options: dict[str, str], rows: Sequence[Sequence[str]]) -> None:
    name = _name(found, options.get("NAME", ""))
    if "COMBINE" in options:
        raise ValueError(f"surface '{options.get('NAME', '')}' is combined of others: name its faces themselves")
    if options.get("TYPE", "ELEMENT").upper() == "NODE":
        found.node_sets.setdefault(name, []).extend(row[0] for row in rows)
    else:
        found.surfaces.setdefault(name, []).extend((row[0], row[1].upper() if len(row) > 1 else "") for row in rows)


def _resolved(sets: dict[str, list[str]], extra: dict[str, Array], name: str) -> Array:
    """Numbers of a set, sets within it included; of a bare number, that number.

    Raises ValueError for a set that is not there, or holds itself.
    """
    if name.isdigit():
        return np.array([int(name)])
    key = name.upper().rpartition(".")[2]  # instance.set
    if key not in sets and key not in extra:
        raise ValueError(f"set '{name}' is used and not defined")
    bare = [m for m in sets.get(key, ()) if m.isdigit()]
    rest = {k: v for k, v in sets.items() if k != key}
    inner = [_resolved(rest, extra, m) for m in sets.get(key, ()) if not m.isdigit()]
    return np.unique(np.concatenate([np.array(bare, dtype=int), extra.get(key, np.zeros(0, dtype=int)), *inner]))


def _solid_file(found: _Input) -> SolidFile:
    if not found.numbers:
        raise ValueError("it has no *NODE")
    numbers, at = np.concatenate(found.numbers), np.vstack(found.points) + found.shift
    own: dict[str, Array] = {}  # sets of *ELEMENT lines
    for e in found.elements:
        if e.set_name is not None:
            own[e.set_name] = np.concatenate([own.get(e.set_name, np.zeros(0, dtype=int)), e.numbers])
    solids = tuple(Solids(e.shape, from_numbers(numbers, e.nodes)) for e in found.elements if e.shape)
    outer = outer_sides(solids)
    surfaces = {found.spelt[name]: _sides(found, own, numbers, outer, rows) for name, rows in found.surfaces.items()}
    given = {found.spelt[n]: _faces(found, numbers, _resolved(found.element_sets, own, n)) for n in found.element_sets}
    lines = {found.spelt[n]: _faces(found, numbers, members) for n, members in own.items()}
    nodes = {
        found.spelt[n]: sides_within(outer, from_numbers(numbers, _resolved(found.node_sets, {}, n)))
        for n in found.node_sets
    }
    return SolidFile(at, solids, (surfaces, given, lines, nodes), tuple(found.types))


def _faces(found: _Input, numbers: Array, members: Array) -> list[Array]:
    """Corners of the face elements of a set; none of a set with solids in it."""
    chosen = [(e, np.isin(e.numbers, members)) for e in found.elements]
    if any(e.shape and here.any() for e, here in chosen):
        return []
    return [from_numbers(numbers, e.nodes[here]) for e, here in chosen if here.any()]


def _sides(
    found: _Input, own: dict[str, Array], numbers: Array, outer: dict[int, Array], rows: Sequence[tuple[str, str]]
) -> list[Array]:
    """Corners of a surface's faces: sides of solids by their number, face elements, or all outer sides of solids."""
    pieces = []
    for who, side in rows:
        members = _resolved(found.element_sets, own, who)
        for e in found.elements:
            here = np.isin(e.numbers, members)
            if not here.any():
                continue
            nodes = from_numbers(numbers, e.nodes[here])
            if e.shape is None:
                pieces.append(nodes)
            elif re.fullmatch(r"S\d", side):
                sides = _SIDES[e.shape]
                if not 1 <= int(side[1]) <= len(sides):
                    raise ValueError(f"a {e.shape} has no side {side}")
                pieces.append(nodes[:, list(sides[int(side[1]) - 1])])
            else:
                own_sides = outer_sides([Solids(e.shape, nodes)])
                pieces += [_common(s, outer.get(k, s[:0])) for k, s in own_sides.items()]
    return pieces


def _common(sides: Array, outer: Array) -> Array:
    both = np.sort(np.vstack([outer, sides]), axis=1)
    _, inverse = np.unique(both, axis=0, return_inverse=True)
    inverse = inverse.ravel()
    return sides[np.isin(inverse[len(outer) :], inverse[: len(outer)])]
