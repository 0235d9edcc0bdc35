"""The full model restricted to linear elements: the same tetrahedra, half as many unknowns along every edge.

Middles of edges have the mean of their ends. That is a Galerkin restriction of the quadratic model to a subspace, so
all that stands on the quadratic model (sensors, ports, films, joints, scales) holds as it is. Faces are flat: on curved
tetrahedra linear elements would not even turn without strain.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import block_diag, csr_array, identity, kron, vstack
from skfem import MeshTet1, MeshTet2

from twin.build.elasticity import Elasticity
from twin.build.mesh import BodyMesh, PartMesh, body_mesh, part_mesh
from twin.build.project import rows_times
from twin.rom.model import AffineBody


def straightened(body: BodyMesh) -> BodyMesh:
    """The body with flat faces between its vertices; unknowns and surfaces keep their numbers."""
    return body_mesh(body.name, tuple(_straight(part) for part in body.parts))


def from_vertices(body: BodyMesh) -> csr_array:
    """(n, m): values at the nodes of a body from those at its m vertices."""
    return csr_array(block_diag([_of_part(part) for part in body.parts], format="csr"))


def vertices(body: BodyMesh) -> np.ndarray:
    """(m,) which of the body's nodes are vertices, in the order of `from_vertices`."""
    parts = zip(body.parts, body.offsets, strict=True)
    return np.concatenate([offset + np.arange(part.mesh.nvertices) for part, offset in parts])


def linear_elasticity(body: BodyMesh, solid: Elasticity, U: csr_array) -> tuple[Elasticity, csr_array, np.ndarray]:
    """Stiffness, port functionals (3m, p) and points (m, 3) [m] of a straight body with linear displacements.

    Heat keeps its columns, one per node: temperatures at the middles of edges are those of whoever asks.
    """
    V = csr_array(kron(from_vertices(body), identity(3), format="csr"))
    restricted = replace(solid, K=csr_array(V.T @ solid.K @ V), KT=csr_array(V.T @ solid.KT))
    return restricted, csr_array(V.T @ U), body.nodes[vertices(body)]


def from_vertices_and_tanks(mesh: BodyMesh, n: int) -> csr_array:
    """(n, m): values at all n unknowns of a thermal body from its vertices and its tanks, which follow the nodes."""
    return csr_array(block_diag([from_vertices(mesh), identity(n - mesh.n)], format="csr"))


def linear_body(mesh: BodyMesh, body: AffineBody) -> AffineBody:
    """The thermal body with linear temperatures."""
    V = from_vertices_and_tanks(mesh, body.n)
    keep = np.concatenate([vertices(mesh), np.arange(mesh.n, body.n)])
    ends = np.cumsum([0, *(part.mesh.nvertices for part in mesh.parts)])
    return replace(
        body,
        E=csr_array(V.T @ body.E @ V),
        A0=csr_array(V.T @ body.A0 @ V),
        A=tuple(csr_array(V.T @ a @ V) for a in body.A),
        M=V.T @ body.M,
        B=V.T @ body.B,
        P=V.T @ body.P,
        H=None if body.H is None else V.T @ body.H,
        raised=None if body.raised is None else np.array([V.T @ columns for columns in body.raised]),
        C=body.C @ V,
        G=rows_times(body.G, V),
        W=None if body.W is None else rows_times(body.W, V),
        F=None if body.F is None else body.F @ V,
        one=body.one[keep],
        energy=V.T @ body.energy,
        first=(*ends[:-1].tolist(), *(int(ends[-1]) + i for i in range(body.n - mesh.n))),
    )


def _straight(part: PartMesh) -> PartMesh:
    if not isinstance(part.mesh, MeshTet2):
        return part
    return part_mesh(part.name, MeshTet1(part.mesh.p, part.mesh.t), part.surfaces)


def _of_part(part: PartMesh) -> csr_array:
    n, edges = part.mesh.nvertices, part.mesh.edges
    middles = np.arange(part.mesh.nedges)
    half = csr_array((np.full(2 * len(middles), 0.5), (np.tile(middles, 2), edges.ravel())), (len(middles), n))
    return csr_array(vstack([identity(n), half], format="csr"))
