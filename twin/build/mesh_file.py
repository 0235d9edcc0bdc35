"""Mesh files with their named surfaces as tetrahedra: which reader reads which format."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twin.build.mesh_formats import abaqus, ansys, by_meshio, ideas, nastran
from twin.build.mesh_formats.named_faces import named_triangles
from twin.build.mesh_formats.solid_file import SolidFile
from twin.build.mesh_formats.tetrahedra import check_middles, tetrahedra
from twin.errors import DescriptionError
from twin.units import to_si

# meshio loses the sets of these: surfaces of solids (Abaqus), cards (Nastran), components (Ansys); it reads no I-deas.
READERS = {
    ".inp": abaqus.read, ".bdf": nastran.read, ".nas": nastran.read, ".fem": nastran.read, ".cdb": ansys.read,
    ".unv": ideas.read,
}  # fmt: skip
GEOMETRY = (".step", ".stp", ".iges", ".igs", ".brep", ".stl", ".x_t", ".sat")


@dataclass(frozen=True)
class TetraFile:
    """Tetrahedra and named triangles of a file; every point is used by a tetrahedron."""

    points: np.ndarray  # (n_points, 3) m
    tetra: np.ndarray  # (n_elements, 4 or 10) in VTK order
    surfaces: dict[str, np.ndarray]  # name -> (n_triangles, 3) corner points; -1 for a point no tetrahedron uses


def read_tetra_file(path: Path, unit: str, where: str) -> TetraFile:
    """Read a mesh file whose coordinates are in `unit` ("m", "mm", "inch", ...).

    Solids of other shapes are divided into tetrahedra (`mesh_formats.tetrahedra`).

    Raises DescriptionError: no such file, unreadable, no solids, a unit that is no length.
    """
    try:
        scale = to_si(f"1 {unit}", "m")
    except ValueError as e:
        raise DescriptionError(f"'{unit}' is no unit of length", f"{where}_unit", "write 'm', 'mm' or 'inch'") from e
    file = _read(path, where)
    if not file.solids:
        kinds = f", only {', '.join(dict.fromkeys(file.found))}" if file.found else ""
        raise DescriptionError(
            f"the mesh has no solids{kinds}", str(path), "export the volume mesh, not only its surface"
        )
    if file.points.shape[1] != 3:
        raise DescriptionError(
            f"points have {file.points.shape[1]} coordinates", str(path), "export a mesh in three dimensions"
        )
    points, tetra = _tetrahedra(file, path)
    used, compact = np.unique(tetra, return_inverse=True)
    renumber = np.full(len(points), -1)
    renumber[used] = np.arange(used.size)
    surfaces = {name: renumber[found] for name, found in named_triangles(file.faces).items()}
    return TetraFile(points[used] * scale, compact.reshape(tetra.shape), surfaces)


def _tetrahedra(file: SolidFile, path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Tetrahedra of one order as they are, everything else divided and completed."""
    try:
        for solids in file.solids:
            check_middles(file.points, solids)
    except ValueError as e:
        raise DescriptionError(str(e), str(path), "export it again, as gmsh 4.1 (.msh) for example") from e
    cells = [s.cells for s in file.solids]
    alike = {(s.shape, s.cells.shape[1]) for s in file.solids}
    if alike in ({("tetra", 4)}, {("tetra", 10)}) and min(c.min() for c in cells) >= 0:
        return file.points, np.vstack(cells)
    return tetrahedra(file.points, file.solids)


def _read(path: Path, where: str) -> SolidFile:
    if not path.is_file():
        raise DescriptionError(f"no mesh file {path}", where, "paths are relative to machine.toml; check the spelling")
    ending = path.suffix.lower()
    if ending in GEOMETRY:
        raise DescriptionError(
            f"'{path.name}' is a geometry and no mesh", where,
            "mesh it first: its solid with tetrahedra, its faces with names",
        )  # fmt: skip
    try:
        return READERS.get(ending, by_meshio.read)(path)
    except (ValueError, OSError, LookupError, ArithmeticError, RuntimeError, StopIteration) as e:
        said = str(e) if isinstance(e, ValueError | OSError) else "it ends early or is damaged"
        raise DescriptionError(
            f"cannot be read as a mesh: {said}",
            str(path),
            "export it again, as gmsh 4.1 (.msh) for example; the ending must match the format",
        ) from e
