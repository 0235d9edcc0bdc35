"""Remake the mesh files of tests/build/test_mesh_formats.py: `python tests/build/meshes/make.py`.

A quarter of a ring, radii 20 and 40 mm, height 30 mm, in millimetres: once as tetrahedra, once half of hexahedra and
half of wedges, with mid-edge nodes and without; its faces named bottom, top, inner, outer and cut. gmsh writes all
formats that it knows, mapdl-archive the Ansys archive, meshio the VTU file. Needs gmsh, mapdl-archive, pyvista.
"""

from __future__ import annotations

import contextlib
from pathlib import Path

import gmsh
import meshio
import numpy as np
import pyvista
from mapdl_archive import save_as_archive
from meshio._mesh import topological_dimension

topological_dimension.setdefault("wedge15", 3)  # meshio 5.3.5 lacks it
HERE = Path(__file__).parent
INNER, OUTER, HEIGHT = 20.0, 40.0, 30.0  # mm
FORMATS = {"tetra2": ("msh", "msh22", "inp", "bdf", "unv", "med", "vtk"),
           "mixed1": ("msh", "inp", "bdf", "unv", "med"),
           "mixed2": ("msh", "msh22", "inp", "bdf", "unv", "med", "vtk")}  # fmt: skip


def sector(start: float, end: float) -> int:
    occ = gmsh.model.occ
    at = {(r, a): occ.addPoint(r * np.cos(a), r * np.sin(a), 0) for r in (INNER, OUTER) for a in (start, end)}
    centre = occ.addPoint(0, 0, 0)
    loop = [
        occ.addLine(at[INNER, start], at[OUTER, start]),
        occ.addCircleArc(at[OUTER, start], centre, at[OUTER, end]),
        occ.addLine(at[OUTER, end], at[INNER, end]),
        occ.addCircleArc(at[INNER, end], centre, at[INNER, start]),
    ]
    return occ.addPlaneSurface([occ.addCurveLoop(loop)])


def ring(mixed: bool, order: int) -> None:
    gmsh.model.add("ring")
    quarter = np.pi / 4
    bases = [(2, sector(0, quarter)), (2, sector(quarter, 2 * quarter))]
    gmsh.model.occ.extrude(bases, 0, 0, HEIGHT, numElements=[2] if mixed else [], recombine=mixed)
    gmsh.model.occ.fragment(gmsh.model.occ.getEntities(3), [])
    gmsh.model.occ.removeAllDuplicates()
    gmsh.model.occ.synchronize()
    names: dict[str, list[int]] = {}
    for _, tag in gmsh.model.getEntities(2):
        if (name := face(tag)) != "inside":
            names.setdefault(name, []).append(tag)
    for name, tags in names.items():
        gmsh.model.addPhysicalGroup(2, tags, name=name)
    gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)], name="ring")
    if mixed:
        first = next(t for _, t in gmsh.model.getEntities(2) if face(t) == "bottom")
        gmsh.model.mesh.setRecombine(2, first)
    gmsh.option.setNumber("Mesh.MeshSizeMin", 14)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 14)
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(order)


def face(tag: int) -> str:
    """By the centre of its bounding box."""
    low, high = np.array(gmsh.model.getBoundingBox(2, tag)).reshape(2, 3)
    if high[2] - low[2] < 1e-3:
        return "bottom" if low[2] < 1 else "top"
    if gmsh.model.getType(2, tag) == "Plane":
        return "cut" if min(high[:2] - low[:2]) < 1e-3 else "inside"
    return "inner" if np.hypot(*gmsh.model.occ.getCenterOfMass(2, tag)[:2]) < 30 else "outer"


def archive(name: str) -> None:
    """The Ansys archive, with a component of nodes per surface."""
    mesh = meshio.read(HERE / f"{name}.msh")
    solid = [c for c in mesh.cells if c.type.startswith(("tetra", "wedge", "hexahedron"))]
    grid = pyvista.from_meshio(meshio.Mesh(mesh.points, solid))
    for surface in ("bottom", "top", "inner", "outer", "cut"):
        inside = np.zeros(len(mesh.points), dtype=bool)
        for block, chosen in zip(mesh.cells, mesh.cell_sets[surface], strict=True):
            inside[block.data[np.asarray(chosen, dtype=int)].ravel()] = True
        grid.point_data[surface.upper()] = inside
    save_as_archive(HERE / f"{name}.cdb", grid)


def tagged(name: str) -> None:
    """The VTU file: no names, one integer per cell."""
    mesh = meshio.read(HERE / f"{name}.msh")
    tags = mesh.cell_data["gmsh:physical"]
    meshio.write(HERE / f"{name}.vtu", meshio.Mesh(mesh.points, mesh.cells, cell_data={"group": tags}))


def main() -> None:
    for name, endings in FORMATS.items():
        gmsh.initialize()
        gmsh.option.setNumber("General.Terminal", 0)
        ring(name.startswith("mixed"), int(name[-1]))
        for ending in endings:
            gmsh.option.setNumber("Mesh.SaveElementTagType", 2 if ending in ("bdf", "vtk") else 1)
            gmsh.option.setNumber("Mesh.MshFileVersion", 2.2 if ending == "msh22" else 4.1)
            stem = f"{name}_22.msh" if ending == "msh22" else f"{name}.{ending}"
            with contextlib.chdir(HERE):  # an Abaqus file begins with the path that it was given
                gmsh.write(stem)
        gmsh.finalize()
        archive(name)
    tagged("tetra2")
    tagged("mixed2")


if __name__ == "__main__":
    main()
