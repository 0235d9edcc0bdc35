"""Ansys MAPDL archives (.cdb), as CDWRITE and Workbench write them: NBLOCK, EBLOCK and CMBLOCK.

Faces have names in three ways, the first wins where several say the same: components of surface elements (SURF152,
SHELL181, ...), components of nodes (all outer sides within them; a named selection of faces is one), and the type
number of surface elements. Nodes of solids and what becomes of them where some coincide: Ansys Element Reference,
SOLID186; a middle that is missing (0) is that of a straight edge.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from twin.build.mesh_formats.solid_file import Array, SolidFile, Solids, from_numbers, outer_sides, sides_within

# Elements that lie on surfaces: thermal and structural surface effect, shells, contact and target, mesh only.
_ON_SURFACES = {
    22, 28, 41, 43, 57, 63, 91, 93, 99, 131, 132, 152, 154, 156, 157, 163, 170, 173, 174, 175, 181, 200, 208, 281,
}  # fmt: skip
# A hexahedron with coinciding corners I J K L M N O P as what it is: corners, then middles in the order of VTK.
_COLLAPSED = {
    "tetra": ((0, 1, 2, 4), (8, 9, 11, 16, 17, 18)),
    "pyramid": ((0, 1, 2, 3, 4), (8, 9, 10, 11, 16, 17, 18, 19)),
    "wedge": ((0, 1, 2, 4, 5, 6), (8, 9, 11, 12, 13, 15, 16, 17, 18)),
    "hexahedron": (tuple(range(8)), tuple(range(8, 20))),
}


@dataclass
class _Archive:
    types: dict[int, int] = field(default_factory=dict)  # type number -> element
    numbers: list[int] = field(default_factory=list)
    points: list[list[float]] = field(default_factory=list)
    solids: dict[tuple[str, bool], list[list[int]]] = field(default_factory=dict)
    faces: dict[int, tuple[int, list[int]]] = field(default_factory=dict)  # element -> type number, corners
    components: dict[str, tuple[str, Array]] = field(default_factory=dict)  # name -> NODE or ELEM, numbers


def read(path: Path) -> SolidFile:
    """Raises ValueError: no blocked nodes or elements, elements of unknown form, broken numbers."""
    archive = _Archive()
    lines = iter(path.read_text(encoding="utf-8", errors="replace").splitlines())
    for line in lines:
        words = [w.strip() for w in line.split("!")[0].split(",")]
        command = words[0].upper()
        if command == "ET" and len(words) > 2:
            archive.types[int(words[1])] = int(re.sub(r"\D", "", words[2]))
        elif command == "ETBLOCK":
            _types(archive, lines)
        elif command == "NBLOCK":
            _nodes(archive, lines)
        elif command == "EBLOCK":
            _elements(archive, lines, solid="SOLID" in (w.upper() for w in words))
        elif command == "CMBLOCK":
            _component(archive, words, lines)
    if not archive.points:
        raise ValueError("it has no NBLOCK: write it with CDWRITE,DB or archive it as blocked")
    numbers = np.array(archive.numbers)
    solids = tuple(Solids(shape, from_numbers(numbers, np.array(rows))) for (shape, _), rows in archive.solids.items())
    kinds = tuple(f"element {e}" for e in archive.types.values())
    return SolidFile(np.array(archive.points), solids, _tiers(archive, numbers, solids), kinds)


def _tiers(archive: _Archive, numbers: Array, solids: Sequence[Solids]) -> tuple[dict[str, list[Array]], ...]:
    outer = outer_sides(solids)
    of_elements = {
        name: _pieces(numbers, [archive.faces[e][1] for e in members.tolist() if e in archive.faces])
        for name, (kind, members) in archive.components.items()
        if kind.startswith("ELEM") and any(e in archive.faces for e in members.tolist())
    }
    # nodes that no element has (of a remote point) may stand in a component
    of_nodes = {
        name: sides_within(outer, from_numbers(numbers, members[np.isin(members, numbers)]))
        for name, (kind, members) in archive.components.items()
        if kind.startswith("NODE")
    }
    by_type: dict[str, list[list[int]]] = {}
    for number, corners in archive.faces.values():
        by_type.setdefault(f"surface_{number}", []).append(corners)
    return of_elements, of_nodes, {name: _pieces(numbers, corners) for name, corners in by_type.items()}


def _pieces(numbers: Array, faces: Sequence[Sequence[int]]) -> list[Array]:
    return [from_numbers(numbers, np.array(rows)) for k in (3, 4) if (rows := [f for f in faces if len(f) == k])]


def _format(line: str) -> tuple[int, int, int]:
    """Of a Fortran format such as (3i9,6e21.13e3): integers, their width, and the width of reals."""
    found = re.match(r"\s*\((\d*)i(\d+)(?:,\s*\d*e(\d+))?", line.lower())
    if found is None:
        raise ValueError(f"'{line.strip()}' is no format of a block")
    return int(found[1] or 1), int(found[2]), int(found[3] or 0)


def _cut(line: str, width: int) -> list[str]:
    return [line[i : i + width] for i in range(0, len(line.rstrip()), width)]


def _types(archive: _Archive, lines: Iterator[str]) -> None:
    _, width, _ = _format(next(lines))
    for line in lines:
        fields = [int(f) for f in _cut(line, width)]
        if fields[0] == -1:
            return
        archive.types[fields[0]] = fields[1]


def _nodes(archive: _Archive, lines: Iterator[str]) -> None:
    count, width, real = _format(next(lines))
    for line in lines:
        if line.upper().startswith("N,") or line[:width].strip() == "-1":
            return
        archive.numbers.append(int(line[:width]))
        at = [float(f) for f in _cut(line[count * width :], real)[:3]]  # zeros at the end are left out
        archive.points.append([*at, 0.0, 0.0, 0.0][:3])


def _elements(archive: _Archive, lines: Iterator[str], solid: bool) -> None:
    """With SOLID: eleven fields, the ninth the number of nodes, then nodes, on a second line if need be; else five."""
    _, width, _ = _format(next(lines))
    for line in lines:
        fields = [int(f) for f in _cut(line, width)]
        if fields[0] == -1:
            return
        if solid:
            count, nodes = fields[8], fields[11:]
            while len(nodes) < count:
                nodes += [int(f) for f in _cut(next(lines), width)]
            _element(archive, fields[10], fields[1], nodes)
        else:
            _element(archive, fields[0], fields[1], fields[5:])


def _element(archive: _Archive, number: int, kind: int, nodes: list[int]) -> None:
    element = archive.types.get(kind, 0)
    if element in _ON_SURFACES:
        if len(nodes) >= 3:
            archive.faces[number] = (kind, list(dict.fromkeys(nodes[:4])))
        return
    if len(nodes) in (4, 10) and len(set(nodes[:4])) == 4:
        archive.solids.setdefault(("tetra", len(nodes) == 10), []).append(nodes)
        return
    if len(nodes) == 8 or len(nodes) > 10:
        shape = {4: "tetra", 5: "pyramid", 6: "wedge", 8: "hexahedron"}.get(len(set(nodes[:8])))
        if shape is None:
            raise ValueError(f"element {number} (type {element}) has {len(set(nodes[:8]))} different corners")
        corners, middles = _COLLAPSED[shape]
        padded = [*nodes, *[0] * 20][:20]
        quadratic = any(nodes[8:20])
        archive.solids.setdefault((shape, quadratic), []).append(
            [padded[i] for i in (*corners, *(middles if quadratic else ()))]
        )


def _component(archive: _Archive, words: Sequence[str], lines: Iterator[str]) -> None:
    """Numbers, of which a negative one ends a span that began with the one before."""
    per_line, width, _ = _format(next(lines))
    wanted = int(words[3])
    values: list[int] = []
    while len(values) < wanted:
        values += [int(f) for f in _cut(next(lines), width)[:per_line]]
    members: list[int] = []
    for value in values:
        members += [value] if value > 0 else range(members[-1] + 1, -value + 1)
    archive.components[words[1]] = (words[2].upper(), np.array(members, dtype=int))
