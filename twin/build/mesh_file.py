"""Tetrahedral mesh files with their named surfaces, in any format meshio reads.

meshio gives points, cells and names; `skfem.io.meshio.from_meshio` drops the surfaces of quadratic meshes (it looks for
`triangle` where the file holds `triangle6`), so the names are matched here.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import meshio
import numpy as np

from twin.errors import DescriptionError
from twin.units import to_si

_OTHER_SOLIDS = ("hexahedron", "wedge", "pyramid")


@dataclass(frozen=True)
class TetraFile:
    """Tetrahedra and named triangles of a file; every point is used by a tetrahedron."""

    points: np.ndarray  # (n_points, 3) m
    tetra: np.ndarray  # (n_elements, 4 or 10) in VTK order
    surfaces: dict[str, np.ndarray]  # name -> (n_triangles, 3) corner points; -1 for a point no tetrahedron uses


def read_tetra_file(path: Path, unit: str, where: str) -> TetraFile:
    """Read a mesh file whose coordinates are in `unit` ("m", "mm", ...).

    Raises DescriptionError: no such file, unreadable, no tetrahedra, other solids, a unit that is no length.
    """
    try:
        scale = to_si(f"1 {unit}", "m")
    except ValueError as e:
        raise DescriptionError(f"'{unit}' is no unit of length", f"{where}_unit", "write 'm' or 'mm'") from e
    data = _read(path, where)
    blocks = {kind: [c.data for c in data.cells if c.type == kind] for kind in ("tetra", "tetra10")}
    others = sorted({c.type for c in data.cells if c.type.startswith(_OTHER_SOLIDS)})
    if others or (blocks["tetra"] and blocks["tetra10"]):
        kinds = others or ["tetra", "tetra10"]
        raise DescriptionError(
            f"the mesh mixes or uses other solids: {', '.join(kinds)}",
            str(path),
            "mesh the solid with tetrahedra of one order",
        )
    cells = blocks["tetra10"] or blocks["tetra"]
    if not cells or not sum(map(len, cells)):
        raise DescriptionError("the mesh has no tetrahedra", str(path), "export the volume mesh, not only its surface")
    tetra = np.vstack(cells)
    used, compact = np.unique(tetra, return_inverse=True)
    renumber = np.full(len(data.points), -1)
    renumber[used] = np.arange(used.size)
    surfaces = {name: renumber[triangles] for name, triangles in _named_triangles(data).items()}
    points = np.asarray(data.points, dtype=float)
    if points.shape[1] != 3:
        raise DescriptionError(
            f"points have {points.shape[1]} coordinates", str(path), "export a mesh in three dimensions"
        )
    return TetraFile(points[used] * scale, compact.reshape(tetra.shape), surfaces)


def _read(path: Path, where: str) -> meshio.Mesh:
    if not path.is_file():
        raise DescriptionError(f"no mesh file {path}", where, "paths are relative to machine.toml; check the spelling")
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said):  # meshio prints the reason of a failure and leaves with SystemExit
            return meshio.read(path)
    except (Exception, SystemExit) as e:
        reason = said.getvalue().strip().splitlines()
        raise DescriptionError(
            f"cannot be read as a mesh: {reason[0] if reason else str(e) or type(e).__name__}",
            str(path),
            "export it again, as gmsh 4.1 (.msh) for example; the ending must match the format",
        ) from e


def _named_triangles(data: meshio.Mesh) -> dict[str, np.ndarray]:
    """Corner points of the triangles of every named surface, empty ones included.

    Names come from cell sets (gmsh 4.1, Abaqus), from physical tags (gmsh 2.2), from families (MED); integer tags
    without a name (VTU, Medit) become "surface_<tag>".
    """
    corners = [c.data[:, :3] if c.type.startswith("triangle") else None for c in data.cells]
    pieces = _of_cell_sets(data, corners)
    for name, triangles in _of_tags(data, corners):
        if name not in data.cell_sets:
            pieces.setdefault(name, []).append(triangles)
    for name, entry in data.field_data.items():
        if len(entry) == 2 and entry[1] == 2:
            pieces.setdefault(name, [])  # named in the file, but without triangles
    empty = np.zeros((0, 3), dtype=int)
    return {name: np.vstack([empty, *found]) for name, found in pieces.items()}


def _of_cell_sets(data: meshio.Mesh, corners: list[np.ndarray | None]) -> dict[str, list[np.ndarray]]:
    """Triangles of every cell set that is a surface: those without any unless they are of a volume, line or point."""
    solid = [c.type.startswith("tetra") for c in data.cells]
    pieces: dict[str, list[np.ndarray]] = {}
    for name, per_block in data.cell_sets.items():
        if name.startswith("gmsh:"):
            continue
        chosen = [c[_indices(i)] for c, i in zip(corners, per_block, strict=True) if c is not None and i is not None]
        in_solid = any(len(_indices(i)) for s, i in zip(solid, per_block, strict=True) if s and i is not None)
        elsewhere = name in data.field_data and data.field_data[name][1] != 2  # a named volume, line or point
        if sum(map(len, chosen)) or not (in_solid or elsewhere):
            pieces[name] = chosen
    return pieces


def _of_tags(data: meshio.Mesh, corners: list[np.ndarray | None]) -> Iterator[tuple[str, np.ndarray]]:
    """Triangles of one tag in one block, under each of its names."""
    tags, names = _surface_tags(data)
    for c, tag in zip(corners, tags, strict=True):
        if c is None or tag is None:
            continue
        for value in np.unique(tag):
            for name in names.get(int(value), [f"surface_{value}"]):
                yield name, c[tag == value]


def _surface_tags(data: meshio.Mesh) -> tuple[list[np.ndarray | None], dict[int, list[str]]]:
    """Integer tag of every cell per block (None where there is none) and the names of the tags of surfaces."""
    none: list[np.ndarray | None] = [None] * len(data.cells)
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
        if all(np.issubdtype(np.asarray(b).dtype, np.integer) and np.asarray(b).ndim == 1 for b in per_block):
            return [np.asarray(b) for b in per_block], {}
    return none, {}


def _indices(entry: object) -> np.ndarray:
    """Cell indices of one block of a cell set; gmsh sets of no cells come as float arrays."""
    return np.asarray(entry, dtype=int).ravel()
