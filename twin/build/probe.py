"""Temperature at a point of a part: a row of quadratic shape functions."""

from __future__ import annotations

import numpy as np
from skfem import ElementTetP2, MeshTet2

from twin.build.clip import p2_triangle
from twin.build.mesh import PartMesh
from twin.build.surface import facet_nodes
from twin.errors import DescriptionError

FAR = 0.05  # of the part's diagonal: points further outside are mistakes


def near(part: PartMesh, point: np.ndarray) -> bool:
    """Whether `probe` takes the point (3,) [m]."""
    try:
        probe(part, point, "")
    except DescriptionError:
        return False
    return True


def probe(part: PartMesh, point: np.ndarray, where: str) -> tuple[np.ndarray, np.ndarray]:
    """Unknowns (k,) of the part and weights (k,), summing to 1, that interpolate at `point` (3,) [m].

    A point outside takes the nearest point of the surface, as sensors are glued onto it. Raises DescriptionError
    where that is further away than 5 % of the part's diagonal.
    """
    point = np.asarray(point, dtype=float)
    inside = _element_at(part, point)
    if inside is not None:
        element, xi = inside
        return part.elements[element], _p2_tetrahedron(xi[:, None])[0][:, 0]
    nodes = facet_nodes(part, part.mesh.boundary_facets())
    corners = part.nodes[nodes[:, :3]]
    barycentric, distance = nearest_in_triangles(corners, point)
    best = int(distance.argmin())
    diagonal = float(np.linalg.norm(np.ptp(part.nodes, axis=0)))
    if distance[best] > FAR * diagonal:
        low, high = part.nodes.min(axis=0), part.nodes.max(axis=0)
        raise DescriptionError(
            f"the point {point} m is {distance[best]:.3g} m away from part '{part.name}'",
            where,
            f"positions are in machine coordinates at axis positions zero; the part reaches from {low} to {high} m",
        )
    return nodes[best], p2_triangle(barycentric[best])


def nearest_in_triangles(corners: np.ndarray, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Barycentric coordinates (m, 3) of the point of each triangle (m, 3, 3) nearest to `point`, and distances (m,).

    The least distance of: the foot of the perpendicular, where it lies inside, and the nearest points of the edges.
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    candidates = []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        edge = corners[:, j] - corners[:, i]
        t = np.einsum("mx,mx->m", point - corners[:, i], edge) / np.einsum("mx,mx->m", edge, edge)
        t = np.clip(t, 0.0, 1.0)
        weights = np.zeros((len(corners), 3))
        weights[:, i], weights[:, j] = 1.0 - t, t
        candidates.append(weights)
    cross = np.cross(b - a, c - a)
    scale = np.einsum("mx,mx->m", cross, cross)
    l1 = np.einsum("mx,mx->m", np.cross(point - a, c - a), cross) / scale
    l2 = np.einsum("mx,mx->m", np.cross(b - a, point - a), cross) / scale
    foot = np.column_stack([1.0 - l1 - l2, l1, l2])
    foot = np.where(np.all(foot >= 0, axis=1, keepdims=True), foot, candidates[0])
    weights = np.stack([foot, *candidates])  # (4, m, 3)
    distance = np.linalg.norm(np.einsum("kmc,mcx->kmx", weights, corners) - point, axis=2)
    best = distance.argmin(axis=0)
    row = np.arange(len(corners))
    return weights[best, row], distance[best, row]


def _element_at(part: PartMesh, point: np.ndarray) -> tuple[int, np.ndarray] | None:
    """The element that holds the point and its reference coordinates (3,), or None."""
    x = part.nodes[part.elements]  # (n, 10, 3)
    low, high = x.min(axis=1), x.max(axis=1)
    size = (high - low).max(axis=1, keepdims=True)
    margin = (0.25 if isinstance(part.mesh, MeshTet2) else 1e-9) * size  # curved elements bulge beyond their nodes
    near = np.all(np.logical_and(point >= low - margin, point <= high + margin), axis=1)
    for element in np.flatnonzero(near):
        xi = _reference_point(x[element], point)
        if min(xi.min(), 1.0 - xi.sum()) >= -1e-9:
            return int(element), xi
    return None


def _reference_point(x: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Reference coordinates (3,) of a point in the quadratic element with nodes x (10, 3), by Newton's method.

    Exact after one step on straight elements; far outside it may not converge, and the result is then no inner point.
    """
    xi = np.full(3, 0.25)
    for _ in range(20):
        N, dN = _p2_tetrahedron(xi[:, None])
        step = np.linalg.solve(x.T @ dN[:, :, 0], point - N[:, 0] @ x)
        xi = np.clip(xi + step, -2.0, 3.0)
        if np.abs(step).max() < 1e-13:
            break
    return xi


def _p2_tetrahedron(xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shape functions (10, q) and gradients (10, 3, q) at reference coordinates (3, q)."""
    element = ElementTetP2()
    values, gradients = zip(*(element.lbasis(xi, i) for i in range(10)), strict=True)
    return np.stack(values), np.stack(gradients)
