"""I-deas universal files (.unv), as I-deas, NX, Salome and gmsh write them.

Nodes are datasets 2411, 781 or 15, elements 2412 or 780, groups 2467, 2477, 2452, 2435, 2432, 2430, 2429 or 2417. A
group of shell elements is a surface, and so is one of nodes (all outer sides within it) where the former do not say the
same. Without groups, shell elements have the number of their physical property. Format and orders of nodes:
SDRC I-DEAS "Universal file datasets".
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from twin.build.mesh_formats.solid_file import Array, SolidFile, Solids, from_numbers, outer_sides, sides_within

# Descriptor -> shape, and the place in the record of every node in VTK's order: corners, then middles.
_SOLIDS: dict[int, tuple[str, list[int]]] = {
    111: ("tetra", [0, 1, 2, 3]),
    118: ("tetra", [0, 2, 4, 9, 1, 3, 5, 6, 7, 8]),
    112: ("wedge", [0, 1, 2, 3, 4, 5]),
    113: ("wedge", [0, 2, 4, 9, 11, 13, 1, 3, 5, 10, 12, 14, 6, 7, 8]),
    115: ("hexahedron", [0, 1, 2, 3, 4, 5, 6, 7]),
    116: ("hexahedron", [0, 2, 4, 6, 12, 14, 16, 18, 1, 3, 5, 7, 13, 15, 17, 19, 8, 9, 10, 11]),
}
_FACES = {  # shells, membranes, plane elements: corners in the record
    41: [0, 1, 2], 51: [0, 1, 2], 61: [0, 1, 2], 74: [0, 1, 2], 91: [0, 1, 2],
    42: [0, 2, 4], 52: [0, 2, 4], 62: [0, 2, 4], 72: [0, 2, 4], 92: [0, 2, 4],
    44: [0, 1, 2, 3], 54: [0, 1, 2, 3], 64: [0, 1, 2, 3], 71: [0, 1, 2, 3], 94: [0, 1, 2, 3],
    45: [0, 2, 4, 6], 55: [0, 2, 4, 6], 65: [0, 2, 4, 6], 75: [0, 2, 4, 6], 95: [0, 2, 4, 6],
}  # fmt: skip
_BEAMS = range(21, 25)  # have a record more
_GROUPS = {2467: 4, 2477: 4, 2452: 4, 2435: 4, 2432: 2, 2430: 2, 2429: 2, 2417: 2}  # integers per member
_NODE, _ELEMENT = 7, 8  # kinds of members


def read(path: Path) -> SolidFile:
    """Raises ValueError: no nodes, records that end early, broken numbers."""
    numbers: list[int] = []
    points: list[list[float]] = []
    cells: dict[int, list[list[int]]] = {}
    faces: dict[int, tuple[int, list[int]]] = {}  # element -> property, corners
    groups: dict[str, list[tuple[int, int]]] = {}
    for dataset, lines in _datasets(path):
        if dataset in (2411, 781, 15):
            for number, at in _points(lines, one_line=dataset == 15):
                numbers.append(number)
                points.append(at)
        elif dataset in (2412, 780):
            for number, kind, physical, nodes in _elements(lines, physical=2 if dataset == 2412 else 3):
                if kind in _SOLIDS:
                    cells.setdefault(kind, []).append([nodes[i] for i in _SOLIDS[kind][1]])
                elif kind in _FACES:
                    faces[number] = (physical, [nodes[i] for i in _FACES[kind]])
        elif dataset in _GROUPS:
            groups |= _groups(lines, _GROUPS[dataset])
    if not points:
        raise ValueError("it has no nodes (dataset 2411)")
    known = np.array(numbers)
    solids = tuple(Solids(_SOLIDS[kind][0], from_numbers(known, np.array(rows))) for kind, rows in cells.items())
    return SolidFile(np.array(points), solids, _tiers(known, solids, faces, groups), tuple(map(str, cells)))


def _tiers(
    known: Array,
    solids: Sequence[Solids],
    faces: dict[int, tuple[int, list[int]]],
    groups: dict[str, list[tuple[int, int]]],
) -> tuple[dict[str, list[Array]], ...]:
    outer = outer_sides(solids)
    of_elements, of_nodes = {}, {}
    for name, members in groups.items():
        elements = [n for kind, n in members if kind == _ELEMENT]
        nodes = np.array([n for kind, n in members if kind == _NODE], dtype=int)
        if elements and all(e in faces for e in elements):
            of_elements[name] = _pieces(known, [faces[e][1] for e in elements])
        if nodes.size:
            of_nodes[name] = sides_within(outer, from_numbers(known, nodes))
    by_property: dict[str, list[list[int]]] = {}
    for number, corners in faces.values():
        by_property.setdefault(f"surface_{number}", []).append(corners)
    return of_elements, of_nodes, {name: _pieces(known, rows) for name, rows in by_property.items()}


def _pieces(known: Array, faces: Sequence[Sequence[int]]) -> list[Array]:
    return [from_numbers(known, np.array(rows)) for k in (3, 4) if (rows := [f for f in faces if len(f) == k])]


def _datasets(path: Path) -> Iterator[tuple[int, list[str]]]:
    """(number, lines) of every dataset; a line of -1 begins and ends one."""
    inside: list[str] | None = None
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        if line.strip() != "-1":
            if inside is not None:
                inside.append(line)
        elif inside is None:
            inside = []
        else:
            if inside and inside[0].strip().isdigit():
                yield int(inside[0]), inside[1:]
            inside = None
    if inside:
        raise ValueError("its last dataset does not end with -1")


def _points(lines: Sequence[str], one_line: bool) -> Iterator[tuple[int, list[float]]]:
    step = 1 if one_line else 2
    for i in range(0, len(lines) - step + 1, step):
        words = lines[i].split()
        at = words[4:7] if one_line else lines[i + 1].split()
        yield int(words[0]), [float(w.upper().replace("D", "E")) for w in at]


def _elements(lines: Sequence[str], physical: int) -> Iterator[tuple[int, int, int, list[int]]]:
    i = 0
    while i < len(lines):
        head = [int(w) for w in lines[i].split()]
        count, kind = head[-1], head[1]
        i += 2 if kind in _BEAMS or kind == 11 else 1
        nodes: list[int] = []
        while len(nodes) < count:
            if i >= len(lines):
                raise ValueError(f"element {head[0]} has not {count} nodes")
            nodes += [int(w) for w in lines[i].split()]
            i += 1
        yield head[0], kind, head[physical], nodes


def _groups(lines: Sequence[str], size: int) -> dict[str, list[tuple[int, int]]]:
    """Members (kind, number) by name."""
    found = {}
    i = 0
    while i + 1 < len(lines):
        count, name = int(lines[i].split()[-1]), lines[i + 1].strip()
        i += 2
        values: list[int] = []
        while len(values) < size * count:
            if i >= len(lines):
                raise ValueError(f"group '{name}' has not {count} members")
            values += [int(w) for w in lines[i].split()]
            i += 1
        found[name] = list(zip(values[0::size], values[1::size], strict=True))
    return found
