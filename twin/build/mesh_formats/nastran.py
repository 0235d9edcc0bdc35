"""Nastran bulk data (.bdf, .nas, .dat, .fem), as Nastran's pre- and postprocessors and gmsh write it.

Faces have names, or rather numbers, in two ways: `PLOAD4` on solids (per load set) and `BSURFS` (per region) first,
then shell elements by property. A number becomes a name where a comment of HyperMesh (`$HMNAME PROP 3"top"`), Femap
(`$ Femap Property 3 : top`) or ANSA (`$ANSA_NAME_COMMENT;3;PSHELL;top;`) says one, else "surface_<number>". Cards and
orders of nodes: MSC Nastran Quick Reference Guide.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from twin.build.mesh_formats.solid_file import SHAPES, Array, SolidFile, Solids, from_numbers

_SOLIDS = {"CTETRA": "tetra", "CPYRAM": "pyramid", "CPYRA": "pyramid", "CPENTA": "wedge", "CHEXA": "hexahedron"}
_FACES = {"CTRIA3": 3, "CTRIAR": 3, "CTRIA6": 3, "CQUAD4": 4, "CQUADR": 4, "CQUAD8": 4, "CQUAD": 4}
# The middles of upright edges stand before those of the second base; VTK has them last.
_ORDER = {
    "wedge": [*range(9), 12, 13, 14, 9, 10, 11],
    "hexahedron": [*range(12), 16, 17, 18, 19, 12, 13, 14, 15],
}
_NAMES = (
    (re.compile(r'\$HMNAME\s+(PROP|LOADCOL|GROUP)\s+(\d+)\s*"([^"]+)"'), {"PROP": "P", "LOADCOL": "L", "GROUP": "B"}),
    (re.compile(r"\$\s*Femap.*?(Property|Load Set)\s+(\d+)\s*:\s*(.+)"), {"Property": "P", "Load Set": "L"}),
    (re.compile(r"\$ANSA_NAME(?:_COMMENT)?;(\d+);(PSHELL|PLOAD4|BSURFS);([^;]+);"), {"PSHELL": "P", "PLOAD4": "L",
                                                                                  "BSURFS": "B"}),
)  # fmt: skip


@dataclass
class _Bulk:
    numbers: list[int] = field(default_factory=list)
    points: list[list[float]] = field(default_factory=list)
    solids: dict[tuple[str, bool], list[list[int]]] = field(default_factory=dict)  # (shape, with middles)
    solid_nodes: dict[int, tuple[str, list[int]]] = field(default_factory=dict)  # element -> corners
    shells: dict[int, list[list[int]]] = field(default_factory=dict)  # property -> corners
    shell_nodes: dict[int, list[int]] = field(default_factory=dict)
    loads: dict[int, list[list[int]]] = field(default_factory=dict)  # load set -> fields from the element on
    regions: dict[int, list[list[int]]] = field(default_factory=dict)  # region -> (element, three corners)
    names: dict[tuple[str, int], str] = field(default_factory=dict)


def read(path: Path) -> SolidFile:
    """Raises ValueError: points in local coordinates, included files, cards that lack fields, broken numbers."""
    text = path.read_text(encoding="utf-8", errors="replace").splitlines()
    bulk = _Bulk()
    for line in text:
        _remember(bulk, line)
    for number, card in _cards(text):
        try:
            _take(bulk, card)
        except (ValueError, IndexError) as e:
            raise ValueError(f"line {number}, {card[0]}: {e}") from e
    if not bulk.points:
        raise ValueError("it has no GRID")
    numbers = np.array(bulk.numbers)
    solids = []
    for (shape, quadratic), cells in bulk.solids.items():
        table = from_numbers(numbers, np.array(cells))
        solids.append(Solids(shape, table[:, _ORDER[shape]] if quadratic and shape in _ORDER else table))
    explicit: dict[str, list[list[int]]] = {}
    for sid, rows in bulk.loads.items():
        explicit.setdefault(_name(bulk, "L", sid), []).extend(_loaded(bulk, r) for r in rows)
    for rid, rows in bulk.regions.items():
        explicit.setdefault(_name(bulk, "B", rid), []).extend(_side(bulk, r[0], r[1:]) for r in rows)
    shells: dict[str, list[list[int]]] = {}
    for pid, faces in bulk.shells.items():  # properties of one name are one surface
        shells.setdefault(_name(bulk, "P", pid), []).extend(faces)
    tiers = tuple({n: _pieces(numbers, faces) for n, faces in tier.items()} for tier in (explicit, shells))
    kinds = tuple(f"{shape}{' with mid-edge nodes' if q else ''}" for shape, q in bulk.solids) or ("shells",)
    return SolidFile(np.array(bulk.points), tuple(solids), tiers, kinds)


def _remember(bulk: _Bulk, line: str) -> None:
    """A name that a preprocessor left in a comment."""
    if not line.startswith("$"):
        return
    for pattern, kinds in _NAMES:
        if m := pattern.match(line):
            kind, number = (m[1], m[2]) if m[1] in kinds else (m[2], m[1])
            bulk.names.setdefault((kinds[kind], int(number)), m[3].strip())


def _name(bulk: _Bulk, kind: str, number: int) -> str:
    return bulk.names.get((kind, number), f"surface_{number}")


def _cards(text: Sequence[str]) -> Iterator[tuple[int, list[str]]]:
    """(line number, fields) of every card: small, large and free fields, continuations joined; field 0 is the name."""
    begin = next((i for i, line in enumerate(text) if line.strip().upper().startswith("BEGIN BULK")), -1)
    at, card = 0, list[str]()
    for number, raw in enumerate(text[begin + 1 :], begin + 2):
        line = raw.split("$")[0].expandtabs().rstrip()
        if not line.strip():
            continue
        if line.strip().upper().startswith("ENDDATA"):
            break
        head, fields = _fields(line)
        if (card and not head) or head.startswith(("+", "*")):
            card += fields
            continue
        if card:
            yield at, card
        at, card = number, [head.rstrip("*").upper(), *fields]
    if card:
        yield at, card


def _fields(line: str) -> tuple[str, list[str]]:
    """The first field, and eight (small, free) or four (large) more; continuation marks of the tenth are dropped."""
    if "," in line:
        head, *rest = [f.strip() for f in line.split(",")]
        count = 4 if head.endswith("*") or head.startswith("*") else 8
        return head, [*rest, *[""] * count][:count]
    head = line[:8].strip()
    wide = head.endswith("*") or head.startswith("*")
    count, width = (4, 16) if wide else (8, 8)
    return head, [line[8 + i * width : 8 + (i + 1) * width].strip() for i in range(count)]


def _take(bulk: _Bulk, card: list[str]) -> None:
    name, fields = card[0], card[1:]
    if name == "GRID":
        if fields[1] not in ("", "0"):
            raise ValueError(f"a point in coordinate system {fields[1]}: export points in the basic system")
        bulk.numbers.append(int(fields[0]))
        bulk.points.append([_real(f) for f in fields[2:5]])
    elif name in _SOLIDS:
        _solid(bulk, _SOLIDS[name], int(fields[0]), [int(f) if f else 0 for f in fields[2:]])
    elif name in _FACES:
        corners = [int(f) for f in fields[2 : 2 + _FACES[name]]]
        bulk.shells.setdefault(int(fields[1] or fields[0]), []).append(corners)
        bulk.shell_nodes[int(fields[0])] = corners
    elif name == "PLOAD4":
        _load(bulk, fields)
    elif name == "BSURFS":
        values = [int(f) for f in fields[4:] if f]
        bulk.regions.setdefault(int(fields[0]), []).extend(values[i : i + 4] for i in range(0, len(values), 4))
    elif name == "INCLUDE":
        raise ValueError("it includes another file: join them")


def _solid(bulk: _Bulk, shape: str, element: int, nodes: list[int]) -> None:
    known = SHAPES[shape]
    quadratic = any(nodes[known.corners :])
    count = known.nodes if quadratic else known.corners
    nodes = [*nodes, *[0] * count][:count]
    if not all(nodes[: known.corners]):
        raise ValueError(f"a {shape} has {known.corners} corners")
    bulk.solids.setdefault((shape, quadratic), []).append(nodes)
    bulk.solid_nodes[element] = (shape, nodes[: known.corners])


def _load(bulk: _Bulk, fields: list[str]) -> None:
    """`PLOAD4 SID EID P1 P2 P3 P4 G1 G3/G4`, or `... THRU EID2` on shells."""
    rows = bulk.loads.setdefault(int(fields[0]), [])
    if fields[6].upper() == "THRU":
        rows += [[e, 0, 0] for e in range(int(fields[1]), int(fields[7]) + 1)]
    else:
        rows.append([int(fields[1]), int(fields[6] or 0), int(fields[7] or 0)])


def _loaded(bulk: _Bulk, row: Sequence[int]) -> list[int]:
    """The loaded side of an element: of a tetrahedron the one without G4, else the one with G1 and G3."""
    element, first, other = row
    if element in bulk.shell_nodes:
        return bulk.shell_nodes[element]
    if element not in bulk.solid_nodes:
        raise ValueError(f"PLOAD4 of element {element}, which is not there")
    shape, corners = bulk.solid_nodes[element]
    if shape == "tetra":
        return [c for c in corners if c != other]
    sides = [[corners[i] for i in side] for side in SHAPES[shape].sides]
    # G1 and G3 stand across on a four-sided side; of a three-sided one G3 is blank (or another of its corners)
    across = [s for s in sides if len(s) == 4 and {first, other} in ({s[0], s[2]}, {s[1], s[3]})]
    three = [s for s in sides if len(s) == 3 and first in s and other in (0, *s)]
    fitting = across if other and across else three
    if len(fitting) != 1:
        raise ValueError(f"PLOAD4 of element {element} names no side by points {first} and {other}")
    return fitting[0]


def _side(bulk: _Bulk, element: int, nodes: Sequence[int]) -> list[int]:
    if element not in bulk.solid_nodes:
        raise ValueError(f"BSURFS of element {element}, which is not there")
    shape, corners = bulk.solid_nodes[element]
    for side in SHAPES[shape].sides:
        found = [corners[i] for i in side]
        if set(nodes) <= set(found):
            return found
    raise ValueError(f"BSURFS of element {element} names no side of it")


def _pieces(numbers: Array, faces: Sequence[Sequence[int]]) -> list[Array]:
    return [from_numbers(numbers, np.array(rows)) for k in (3, 4) if (rows := [f for f in faces if len(f) == k])]


def _real(field: str) -> float:
    """Nastran's numbers: 1.5, .15E1, 1.5+1 for 15, 1.5D1."""
    text = field.upper().replace("D", "E") or "0"
    return float(re.sub(r"(?<=[\d.])([+-]\d+)$", r"E\1", text) if "E" not in text else text)
