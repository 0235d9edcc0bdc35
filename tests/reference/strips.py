"""Bars as mesh files with one long side cut into strips, each a surface of its own."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
from skfem import MeshTet1

from tests.reference.described import Triple


def strip(number: int) -> str:
    """The name of a strip, from zero on."""
    return f"strip_{number}"


def write_bar(
    path: Path, origin: Triple, size: Triple, divisions: tuple[int, int, int], side: float, edges: np.ndarray
) -> None:
    """A bar of tetrahedra along x (gmsh 2.2): surfaces "base", "end", "flank" (greatest y), strips at z = `side`.

    edges: where strips end [m], on nodes; with the ends of the bar or without. The other outer faces are "sides".
    """
    ends = [(o, o + s) for o, s in zip(origin, size, strict=True)]
    mesh = MeshTet1.init_tensor(*(np.linspace(*e, n + 1) for e, n in zip(ends, divisions, strict=True)))
    corners = mesh.facets[:, mesh.boundary_facets()]
    where = mesh.p[:, corners]  # (3, 3, n)

    def on(axis: int, value: float) -> np.ndarray:
        return np.asarray(np.abs(where[axis] - value).max(axis=0) < 1e-9)

    inner = edges[(edges > ends[0][0] + 1e-9) & (edges < ends[0][1] - 1e-9)]
    number = np.searchsorted(inner, where[0].mean(axis=0))
    tag = np.where(on(2, side), 5 + number, 3)
    tag[on(0, ends[0][0])], tag[on(0, ends[0][1])], tag[on(1, ends[1][1])] = 1, 2, 4
    names = ["base", "end", "sides", "flank", *(strip(i) for i in range(len(inner) + 1))]
    solid = 1 + len(names)
    tags = [np.full(mesh.nelements, solid), tag]
    fields = {name: np.array([i + 1, 2]) for i, name in enumerate(names)} | {"solid": np.array([solid, 3])}
    made = meshio.Mesh(
        mesh.p.T,
        [("tetra", mesh.t.T), ("triangle", corners.T)],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data=fields,
    )
    meshio.write(path, made, "gmsh22")


def part(name: str, of: str, file: str, adiabatic: str) -> str:
    return f'[parts.{name}]\nmaterial = "{of}"\nmesh = "{file}"\nadiabatic = {adiabatic.split()}\n'
