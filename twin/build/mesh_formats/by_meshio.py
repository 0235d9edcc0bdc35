"""Formats whose named faces meshio keeps: gmsh 2.2 and 4.1, MED, VTK, Medit and others.

`skfem.io.meshio.from_meshio` drops the surfaces of quadratic meshes (it looks for `triangle` where the file holds
`triangle6`), so the names are matched here.
"""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Iterator
from pathlib import Path

import meshio
import numpy as np
from meshio._mesh import topological_dimension

from twin.build.mesh_formats.solid_file import SHAPES, Array, SolidFile, Solids

_SOLID = re.compile(r"(tetra|pyramid|wedge|hexahedron)(\d*)$")
_FACE = re.compile(r"(triangle|quad)\d*$")
for _kind in ("wedge15", "pyramid13"):
    topological_dimension.setdefault(_kind, 3)  # meshio 5.3.5 reads these types and cannot make a block of them


def read(path: Path) -> SolidFile:
    """Raises ValueError with what meshio says of a file that it cannot read."""
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said):  # meshio prints the reason of a failure and leaves with SystemExit
            data = meshio.read(path)
    except (Exception, SystemExit) as e:
        reason = said.getvalue().strip().splitlines()
        raise ValueError(reason[0] if reason else str(e) or type(e).__name__) from e
    solids = [s for c in data.cells if (s := _solids(c)) is not None]
    return SolidFile(
        np.asarray(data.points, dtype=float), tuple(solids), (_named_faces(data),), tuple(c.type for c in data.cells)
    )


def _solids(block: meshio.CellBlock) -> Solids | None:
    """Nodes at the centres of sides and solids (27-node hexahedra and the like) are left out."""
    kind = _SOLID.match(block.type)
    if kind is None or not len(block.data):
        return None
    shape = SHAPES[kind[1]]
    count = shape.nodes if kind[2] else shape.corners
    if block.data.shape[1] < count:
        return None
    return Solids(kind[1], block.data[:, :count].astype(int))


def _named_faces(data: meshio.Mesh) -> dict[str, list[Array]]:
    """Corner points of the faces of every named surface, empty ones included.

    Names come from cell sets (gmsh 4.1), from physical tags (gmsh 2.2), from families (MED); integer tags
    without a name (VTU, Medit) become "surface_<tag>".
    """
    corners = [_face_corners(c) for c in data.cells]
    pieces = _of_cell_sets(data, corners)
    for name, faces in _of_tags(data, corners):
        if name not in data.cell_sets:
            pieces.setdefault(name, []).append(faces)
    for name, entry in data.field_data.items():
        if len(entry) == 2 and entry[1] == 2:
            pieces.setdefault(name, [])  # named in the file, but without faces
    return pieces


def _face_corners(block: meshio.CellBlock) -> Array | None:
    kind = _FACE.match(block.type)
    return None if kind is None else block.data[:, : 3 if kind[1] == "triangle" else 4]


def _of_cell_sets(data: meshio.Mesh, corners: list[Array | None]) -> dict[str, list[Array]]:
    """Faces of every cell set that is a surface: those without any unless they are of a volume, line or point."""
    solid = [_SOLID.match(c.type) is not None for c in data.cells]
    pieces: dict[str, list[Array]] = {}
    for name, per_block in data.cell_sets.items():
        if name.startswith("gmsh:"):
            continue
        chosen = [c[_indices(i)] for c, i in zip(corners, per_block, strict=True) if c is not None and i is not None]
        in_solid = any(len(_indices(i)) for s, i in zip(solid, per_block, strict=True) if s and i is not None)
        elsewhere = name in data.field_data and data.field_data[name][1] != 2  # a named volume, line or point
        if sum(map(len, chosen)) or not (in_solid or elsewhere):
            pieces[name] = chosen
    return pieces


def _of_tags(data: meshio.Mesh, corners: list[Array | None]) -> Iterator[tuple[str, Array]]:
    """Faces of one tag in one block, under each of its names."""
    tags, names = _surface_tags(data)
    for c, tag in zip(corners, tags, strict=True):
        if c is None or tag is None:
            continue
        for value in np.unique(tag):
            for name in names.get(int(value), [f"surface_{value}"]):
                yield name, c[tag == value]


def _surface_tags(data: meshio.Mesh) -> tuple[list[Array | None], dict[int, list[str]]]:
    """Integer tag of every cell per block (None where there is none) and the names of the tags of surfaces."""
    none: list[Array | None] = [None] * len(data.cells)
    if "gmsh:physical" in data.cell_data:
        names: dict[int, list[str]] = {}
        for name, (tag, dimension) in data.field_data.items():
            if dimension == 2:
                names.setdefault(int(tag), []).append(name)
        return list(data.cell_data["gmsh:physical"]), names
    families = getattr(data, "cell_tags", None)  # MED; tag 0 is "no family"
    if families and "cell_tags" in data.cell_data:
        return list(data.cell_data["cell_tags"]), {0: [], **{int(tag): list(n) for tag, n in families.items()}}
    if any(name for name in data.cell_sets if not name.startswith("gmsh:")):
        return none, {}
    for per_block in data.cell_data.values():
        tags = [np.asarray(b) for b in per_block]
        one = all(t.ndim == 1 or t.shape[1:] == (1,) for t in tags)  # legacy VTK has one column
        if one and all(np.issubdtype(t.dtype, np.integer) for t in tags):
            return [t.ravel() for t in tags], {}
    return none, {}


def _indices(entry: object) -> Array:
    """Cell indices of one block of a cell set; gmsh sets of no cells come as float arrays."""
    return np.asarray(entry, dtype=int).ravel()
