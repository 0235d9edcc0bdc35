"""Functionals of surface patches on P2 unknowns: area means, first moments, mass matrices.

A patch is a set of facets or, for segments of a rail, of facets clipped exactly at the segment borders. Its mean vector
d0 serves twice: d0 . T is the area-mean temperature, and 1 W spread evenly over the patch loads the nodes with d0.
Integrals are exact on straight-sided facets; curved facets are clipped along their chords, so that segments still
share out the whole surface without gap or overlap.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from skfem import MeshTet2

from twin.build.clip import clip, fan, p2_triangle, p2_triangle_gradient, triangle_rule
from twin.build.mesh import PartMesh
from twin.errors import DescriptionError

_EDGE = np.full((4, 4), -1)
for _k, (_i, _j) in enumerate(((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))):
    _EDGE[_i, _j] = _EDGE[_j, _i] = _k


@dataclass(frozen=True)
class Patch:
    """Area-mean functionals of a piece of surface; x - c below is the distance from its centroid."""

    nodes: np.ndarray  # (m,) unknowns of the part with a share in the patch
    mean: np.ndarray  # (m,) 1: (1/A) int N dA at `nodes`
    moment: np.ndarray  # (3, m) m: (1/A) int (x - c)_j N dA at `nodes`
    centroid: np.ndarray  # (3,) m
    area: float  # m^2
    second_moment: np.ndarray  # (3, 3) m^2: (1/A) int (x - c)_i (x - c)_j dA
    normal: np.ndarray  # (3,) (1/A) int n dA, outward: of length 1 for a plane patch, near 0 for a full cylinder
    n: int  # unknowns of the part

    @property
    def d0(self) -> np.ndarray:
        """(n,) mean functional; sums to 1."""
        full = np.zeros(self.n)
        full[self.nodes] = self.mean
        return full

    @property
    def d1(self) -> np.ndarray:
        """(3, n) [m] first moments about the centroid; each sums to 0."""
        full = np.zeros((3, self.n))
        full[:, self.nodes] = self.moment
        return full


@dataclass(frozen=True)
class SurfacePoints:
    """Quadrature points of a patch: (m pieces, q points)."""

    nodes: np.ndarray  # (m, 6)
    shape: np.ndarray  # (m, q, 6)
    x: np.ndarray  # (m, q, 3) m
    weight: np.ndarray  # (m, q) m^2
    normal: np.ndarray  # (m, q, 3) m^2: n dA, outward


def facet_nodes(part: PartMesh, facets: np.ndarray) -> np.ndarray:
    """P2 unknowns (m, 6) of facets: corners 0 1 2, edges 01 12 20; right-handed seen from outside the solid."""
    mesh = part.mesh
    facets = np.asarray(facets)
    element = mesh.f2t[0, facets]
    t = mesh.t[:4, element]  # (4, m)
    corners = mesh.facets[:3, facets].T.copy()  # (m, 3)
    inside = t.sum(axis=0) - corners.sum(axis=1)  # the vertex off the facet
    p = mesh.p.T
    a, b, c = p[corners[:, 0]], p[corners[:, 1]], p[corners[:, 2]]
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), p[inside] - a) > 0
    corners[inward] = corners[inward][:, [0, 2, 1]]
    local = (t.T[:, None, :] == corners[:, :, None]).argmax(axis=2)  # (m, 3) corner number within the element
    edges = _EDGE[local, np.roll(local, -1, axis=1)]
    return np.column_stack([corners, part.dofs.element_dofs[4 + edges, element[:, None]]])


def patch(part: PartMesh, facets: np.ndarray) -> Patch:
    """Functionals of a set of facets. Raises DescriptionError where there are none."""
    nodes = facet_nodes(part, facets)
    return patch_of(part, surface_points(part, nodes, np.broadcast_to(np.eye(3), (len(nodes), 3, 3)), 3))


def segments(part: PartMesh, facets: np.ndarray, direction: np.ndarray, n: int) -> list[Patch]:
    """Divide facets into `n` patches of equal length along the unit vector `direction`, in increasing order.

    Facets that straddle a border are clipped there. Raises DescriptionError where a segment has no area.
    """
    nodes = facet_nodes(part, facets)
    if not len(nodes):
        raise _no_area(part)
    s = part.nodes[nodes[:, :3]] @ np.asarray(direction, dtype=float)  # (m, 3) corners along the axis
    borders = np.linspace(s.min(), s.max(), n + 1)
    if not s.max() > s.min():
        where = f"{part.name}, at {part.nodes[nodes[0, 0]]} m"
        raise DescriptionError("the surface has no length along the axis", where, "check the direction of the axis")
    result = []
    for i, (low, high) in enumerate(pairwise(borders)):
        rows = np.flatnonzero((s.max(axis=1) > low) & (s.min(axis=1) < high))
        pieces = np.broadcast_to(np.eye(3), (rows.size, 3, 3))
        counts = np.full(rows.size, 3)
        if i > 0:
            pieces, counts = clip(pieces, counts, np.einsum("mkc,mc->mk", pieces, s[rows]) - low)
        if i < n - 1:
            pieces, counts = clip(pieces, counts, high - np.einsum("mkc,mc->mk", pieces, s[rows]))
        triangles, owner = fan(pieces, counts)
        result.append(patch_of(part, surface_points(part, nodes[rows[owner]], triangles, 3)))
    return result


def mass(part: PartMesh, facets: np.ndarray, pieces: np.ndarray | None = None) -> sp.csr_array:
    """int N N^T dA [m^2] over facets, (n, n): the film matrix per W/(m^2 K).

    pieces: (m, 3, 3) triangles in barycentric coordinates of the facets (m,), which may occur twice; by default whole.
    """
    nodes = facet_nodes(part, facets)
    at = surface_points(part, nodes, np.broadcast_to(np.eye(3), (len(nodes), 3, 3)) if pieces is None else pieces, 4)
    local = np.einsum("mq,mqi,mqj->mij", at.weight, at.shape, at.shape)
    return scatter(nodes, nodes, local, part.n)


def scatter(rows: np.ndarray, columns: np.ndarray, local: np.ndarray, n: int) -> sp.csr_array:
    """Sum local matrices (m, a, b) at unknowns rows (m, a) and columns (m, b) into an (n, n) matrix."""
    i = np.broadcast_to(rows[:, :, None], local.shape).ravel()
    j = np.broadcast_to(columns[:, None, :], local.shape).ravel()
    return sp.coo_array((local.ravel(), (i, j)), shape=(n, n)).tocsr()


def surface_points(part: PartMesh, nodes: np.ndarray, triangles: np.ndarray, degree: int) -> SurfacePoints:
    """Quadrature on triangles (m, 3, 3), given in barycentric coordinates of their facets (m, 6 nodes)."""
    curved = isinstance(part.mesh, MeshTet2)
    rule, weights = triangle_rule(degree + 4 if curved else degree)
    barycentric = np.einsum("qk,mkc->mqc", rule, triangles)
    shape = p2_triangle(barycentric)
    x_nodes = part.nodes[nodes]  # (m, 6, 3)
    tangents = np.einsum("mqid,mix->mqdx", p2_triangle_gradient(barycentric), x_nodes)
    share = np.abs(np.linalg.det(triangles)) / 2.0  # area of the piece in the reference triangle
    normal = np.cross(tangents[:, :, 0], tangents[:, :, 1])  # of length dA / d(reference area)
    weight = weights * share[:, None]  # some rules have a negative one
    x = np.einsum("mqi,mix->mqx", shape, x_nodes)
    return SurfacePoints(nodes, shape, x, weight * np.linalg.norm(normal, axis=2), weight[:, :, None] * normal)


def patch_of(part: PartMesh, at: SurfacePoints) -> Patch:
    """Functionals of what the quadrature points stand for. Raises DescriptionError where they have no area."""
    area = float(at.weight.sum())
    if not area > 0:
        raise _no_area(part)
    nodes, inverse = np.unique(at.nodes, return_inverse=True)
    centroid = np.einsum("mq,mqx->x", at.weight, at.x) / area
    lever = at.x - centroid

    def gather(values: np.ndarray) -> np.ndarray:
        return np.bincount(inverse.ravel(), weights=values.ravel(), minlength=nodes.size) / area

    return Patch(
        nodes=nodes,
        mean=gather(np.einsum("mq,mqi->mi", at.weight, at.shape)),
        moment=np.stack([gather(np.einsum("mq,mq,mqi->mi", at.weight, lever[:, :, j], at.shape)) for j in range(3)]),
        centroid=centroid,
        area=area,
        second_moment=np.einsum("mq,mqi,mqj->ij", at.weight, lever, lever) / area,
        normal=at.normal.sum(axis=(0, 1)) / area,
        n=part.n,
    )


def _no_area(part: PartMesh) -> DescriptionError:
    return DescriptionError(
        "a patch without area", part.name, "name the faces of the surface, and use fewer segments if it has holes"
    )
