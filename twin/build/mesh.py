"""Meshes of parts and bodies: quadratic tetrahedra with named surfaces, in metres, machine coordinates, axes at zero.

Temperatures and displacements live on the same ten nodes per tetrahedron (P2). A straight-sided mesh stays a MeshTet1
whose mid-edge nodes are implied; a file with ten-node tetrahedra becomes a MeshTet2 and keeps its curvature.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from skfem import CellBasis, ElementTetP2, Mesh, MeshTet1, MeshTet2
from skfem.assembly import Dofs

from twin.build.box_mesh import box_mesh
from twin.build.mesh_file import TetraFile, read_tetra_file
from twin.errors import DescriptionError, Problem, TwinError
from twin.machine.bodies import bodies_of
from twin.machine.description import Machine, Part

CHUNK = 20_000  # elements assembled at once: bounds the memory of scikit-fem (facts: 9.5 GB whole, 2.2 GB in chunks)


@dataclass(frozen=True)
class PartMesh:
    """One meshed solid with scalar P2 unknowns."""

    name: str
    mesh: Mesh  # MeshTet1 (straight) or MeshTet2 (curved)
    surfaces: Mapping[str, np.ndarray]  # name -> facet indices of `mesh`; every outer facet is in exactly one
    dofs: Dofs  # scalar P2
    nodes: np.ndarray  # (n, 3) m, location of every P2 unknown: vertices first, then mid-edge nodes

    @property
    def n(self) -> int:
        return self.nodes.shape[0]

    @property
    def elements(self) -> np.ndarray:
        """(n_elements, 10) node numbers in VTK order: vertices, then edges 01 12 02 03 13 23."""
        return self.dofs.element_dofs.T

    @property
    def basis(self) -> CellBasis:
        """Scalar P2 basis over all elements: for small meshes; use `chunks` to assemble large ones."""
        return CellBasis(self.mesh, ElementTetP2(), intorder=_order(self.mesh), dofs=self.dofs, disable_doflocs=True)

    def chunks(self, size: int = CHUNK) -> Iterator[CellBasis]:
        """Scalar P2 bases over successive groups of elements, all numbered like the whole part."""
        for start in range(0, self.mesh.nelements, size):
            elements = np.arange(start, min(start + size, self.mesh.nelements))
            yield CellBasis(
                self.mesh,
                ElementTetP2(),
                intorder=_order(self.mesh),
                elements=elements,
                dofs=self.dofs,
                disable_doflocs=True,
            )

    def facets(self, surface: str) -> np.ndarray:
        """Facet indices of a named surface. Raises DescriptionError with the names there are."""
        if surface not in self.surfaces:
            raise DescriptionError(
                f"unknown surface '{surface}'",
                f"{self.name}.{surface}",
                f"surfaces of '{self.name}' are: {', '.join(self.surfaces)}",
            )
        return self.surfaces[surface]


@dataclass(frozen=True)
class BodyMesh:
    """The parts of one body; unknowns are the parts' P2 unknowns one after the other."""

    name: str
    parts: tuple[PartMesh, ...]
    offsets: tuple[int, ...]  # of each part's first unknown
    n: int
    nodes: np.ndarray  # (n, 3) m

    @property
    def elements(self) -> np.ndarray:
        """(n_elements, 10) node numbers in VTK order."""
        return np.vstack([p.elements + offset for p, offset in zip(self.parts, self.offsets, strict=True)])

    def part(self, name: str) -> tuple[PartMesh, int]:
        """A part and the offset of its unknowns. Raises DescriptionError for a part of another body."""
        for part, offset in zip(self.parts, self.offsets, strict=True):
            if part.name == name:
                return part, offset
        names = ", ".join(p.name for p in self.parts)
        raise DescriptionError(f"'{name}' is no part of body '{self.name}'", name, f"its parts are: {names}")


def body_mesh(name: str, parts: tuple[PartMesh, ...]) -> BodyMesh:
    """Join parts into a body by concatenating their unknowns."""
    sizes = [p.n for p in parts]
    offsets = tuple(int(o) for o in np.concatenate([[0], np.cumsum(sizes)[:-1]]))
    return BodyMesh(name, parts, offsets, int(sum(sizes)), np.vstack([p.nodes for p in parts]))


def part_mesh(name: str, mesh: Mesh, surfaces: Mapping[str, np.ndarray], where: str = "") -> PartMesh:
    """Number the P2 unknowns of a mesh and check its surfaces.

    Raises DescriptionError (all problems at once): flat tetrahedra, a mesh in several pieces, an empty surface,
    facets inside the solid, outer facets in no surface or in two.
    """
    where = where or f"parts.{name}"
    problems = _flat_elements(mesh, where) + _pieces(mesh, where) + _surface_problems(mesh, surfaces, where)
    if problems:
        raise DescriptionError.collect(problems)
    dofs = Dofs(mesh, ElementTetP2())
    if isinstance(mesh, MeshTet2):
        nodes = mesh.doflocs.T
    else:
        nodes = np.vstack([mesh.p.T, mesh.p[:, mesh.edges].mean(axis=1).T])  # Dofs: vertices first, then edges
    return PartMesh(name, mesh, dict(surfaces), dofs, np.ascontiguousarray(nodes))


def load_part_mesh(name: str, part: Part, folder: Path) -> PartMesh:
    """The mesh of a part: its file (path relative to `folder`) or its box.

    Raises DescriptionError: neither or both given, missing or unreadable file, no tetrahedra, and as `part_mesh`.
    """
    where = f"parts.{name}"
    if (part.mesh is None) == (part.box is None):
        raise DescriptionError("give either a mesh or a box", where, "set mesh = 'file.msh' or box = {...}, not both")
    if part.box is not None:
        mesh, surfaces = box_mesh(part.box, f"{where}.box")
        return part_mesh(name, mesh, surfaces, where)
    path = Path(folder) / str(part.mesh)
    file = read_tetra_file(path, part.mesh_unit, f"{where}.mesh")
    mesh = skfem_mesh(file)
    return part_mesh(name, mesh, match_surfaces(mesh, file, str(path)), str(path))


def load_body_meshes(machine: Machine) -> tuple[BodyMesh, ...]:
    """The meshes of all bodies, in the order of `bodies_of`. Raises DescriptionError with the problems of all parts."""
    problems: list[Problem] = []
    parts: dict[str, PartMesh] = {}
    for name, part in machine.parts.items():
        try:
            parts[name] = load_part_mesh(name, part, machine.folder)
        except TwinError as e:
            problems += e.problems
    if problems:
        raise DescriptionError.collect(problems)
    return tuple(body_mesh(b.name, tuple(parts[p] for p in b.parts)) for b in bodies_of(machine))


def skfem_mesh(file: TetraFile) -> Mesh:
    """MeshTet1 or MeshTet2 of a file whose points are all used; vertex numbers keep the order of the points."""
    points, tetra = np.ascontiguousarray(file.points.T), np.ascontiguousarray(file.tetra.T)
    return MeshTet1(points, tetra) if len(tetra) == 4 else MeshTet2(points, tetra)  # edges in the order of VTK, meshio


def _order(mesh: Mesh) -> int:
    """Quadrature degree: exact for N N^T on straight elements, two more for the Jacobian of curved ones."""
    return 6 if isinstance(mesh, MeshTet2) else 4


def match_surfaces(mesh: Mesh, file: TetraFile, where: str) -> dict[str, np.ndarray]:
    """Facet indices of the file's triangles. Raises DescriptionError for triangles that are no outer facets."""
    vertex = np.full(file.points.shape[0] + 1, -1)  # the last entry catches points that no tetrahedron uses
    used = np.unique(file.tetra[:, :4])
    vertex[used] = np.arange(used.size)  # scikit-fem renumbers the vertices in this order
    outer = mesh.boundary_facets()
    known = np.sort(mesh.facets[:, outer].T, axis=1)
    surfaces: dict[str, np.ndarray] = {}
    problems: list[Problem] = []
    for name, triangles in file.surfaces.items():
        wanted = np.unique(np.sort(vertex[triangles], axis=1), axis=0)
        _, inverse = np.unique(np.vstack([known, wanted]), axis=0, return_inverse=True)
        inverse = inverse.ravel()
        facet_of = np.full(inverse.max() + 1, -1)
        facet_of[inverse[: len(known)]] = outer
        found = facet_of[inverse[len(known) :]]
        missing = int((found < 0).sum())
        if missing:
            problems.append(
                Problem(
                    f"{missing} of {len(wanted)} triangles of surface '{name}' are no outer faces of the tetrahedra",
                    where,
                    "name outer faces of the solid only, and export volume and surface mesh together",
                )
            )
        surfaces[name] = np.sort(found[found >= 0])
    if problems:
        raise DescriptionError.collect(problems)
    return surfaces


def _flat_elements(mesh: Mesh, where: str) -> list[Problem]:
    corner = mesh.p[:, mesh.t[:4]]  # (3, 4, n)
    edges = corner[:, 1:] - corner[:, :1]
    volume = np.abs(np.einsum("in,in->n", edges[:, 0], np.cross(edges[:, 1], edges[:, 2], axis=0))) / 6.0
    size = np.linalg.norm(edges, axis=0).max(axis=0)
    flat = np.flatnonzero(volume <= 1e-10 * size**3)
    if not flat.size:
        return []
    return [Problem(f"{flat.size} flat tetrahedra, {_place(corner[:, :, flat])}", where, "optimise or repair the mesh")]


def _pieces(mesh: Mesh, where: str) -> list[Problem]:
    t = mesh.t[:4]
    i, j = np.concatenate([t[0], t[0], t[0]]), np.concatenate([t[1], t[2], t[3]])
    n = mesh.nvertices
    count, _ = connected_components(
        sp.coo_array((np.ones(i.size, dtype=np.int8), (i, j)), shape=(n, n)), directed=False
    )
    if count == 1:
        return []
    return [
        Problem(
            f"the mesh falls into {count} pieces that share no nodes",
            where,
            "merge coincident nodes (one part is one solid), or make each piece a part and join them by fixed contacts",
        )
    ]


def _surface_problems(mesh: Mesh, surfaces: Mapping[str, np.ndarray], where: str) -> list[Problem]:
    problems = []
    times = np.zeros(mesh.nfacets, dtype=int)
    for name, facets in surfaces.items():
        if not len(facets):
            problems.append(Problem(f"surface '{name}' has no facets", where, "remove the name, or put a face into it"))
        times[facets] += 1
    outer = mesh.boundary_facets()
    unnamed = outer[times[outer] == 0]
    if unnamed.size:
        problems.append(
            Problem(
                f"{unnamed.size} of {outer.size} outer facets belong to no named surface, "
                f"{_place(mesh.p[:, mesh.facets[:3, unnamed]])}",
                where,
                "name these faces (gmsh: Physical Surface); each then takes a film, a fixed contact or is adiabatic",
            )
        )
    twice = np.flatnonzero(times > 1)
    if twice.size:
        names = sorted({name for name, facets in surfaces.items() if np.isin(facets, twice).any()})
        problems.append(
            Problem(
                f"{twice.size} facets belong to more than one of the surfaces {', '.join(names)}",
                where,
                "each outer facet must belong to exactly one named surface",
            )
        )
    return problems


def _place(points: np.ndarray) -> str:
    """Where a group of points (3, ...) lies, for messages."""
    x, y, z = points.reshape(3, -1).mean(axis=1)
    return f"centroid at ({x:.4g}, {y:.4g}, {z:.4g}) m"
