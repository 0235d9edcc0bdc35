"""Two surfaces of a body joined over their common area, whether or not their meshes match, or across a gap.

Facet pairs are intersected (polygon clipping) and integrated exactly, as scikit-fem has no three-dimensional mortar
integration. The result, int (N_A - N_B)(N_A - N_B)^T dA, serves thermal joints (times a conductance) and, per
component, the stiffness that glues displacements. Its rows sum to zero: no jump, no flux.

Across a gap, points face each other along the normals of the first surface, and the area is measured on it: what leaves
one point arrives at the other, so heat is conserved where the two areas differ, too (coaxial cylinders).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from twin.build.clip import clip, fan, p2_triangle, triangle_rule
from twin.build.mesh import BodyMesh
from twin.build.surface import facet_nodes, scatter
from twin.errors import DescriptionError
from twin.machine.bodies import split_surface

# Facets that face each other: exact for coplanar ones; the tolerances admit facetted cylinders and rounded coordinates.
MIN_COSINE = 0.95  # of the angle between a normal and the other's reverse
MAX_GAP = 0.1  # distance of the planes, in sizes of the smaller facet
ROUNDED = 1e-6  # share by which a gap may be exceeded: coordinates are rounded
TWICE = 1.001  # common area beyond this share of the first surface's: its points face several layers of the second
PAIRS = 20_000  # facet pairs integrated at once


@dataclass(frozen=True)
class Interface:
    """The coupling of two surfaces of a body with n unknowns."""

    matrix: sp.csr_array  # (n, n) m^2: int (N_A - N_B)(N_A - N_B)^T dA
    area: float  # m^2, common area


@dataclass(frozen=True)
class _Facets:
    nodes: np.ndarray  # (m, 6) unknowns of the body
    corners: np.ndarray  # (m, 3, 3) m
    centre: np.ndarray  # (m, 3) m
    radius: np.ndarray  # (m,) m, about the centre
    normal: np.ndarray  # (m, 3) unit, outward


def interface(body: BodyMesh, a: str, b: str, where: str = "contacts", gap: float | None = None) -> Interface:
    """Intersect the surfaces `a` and `b` ("part.surface") of a body.

    gap: m, up to which points that face each other are joined; without one the surfaces lie on each other.
    Raises DescriptionError where they do not touch, or do not face each other within the gap, or more than once, or a
    surface is unknown.
    """
    fa, fb = _facets(body, a), _facets(body, b)
    pairs = _facing(fa, fb, gap)
    matrix, area = sp.csr_array((body.n, body.n)), 0.0
    for start in range(0, len(pairs), PAIRS):
        i, j = pairs[start : start + PAIRS].T
        nodes, local, shared = _intersect(fa, fb, i, j, gap)
        matrix, area = matrix + scatter(nodes, nodes, local, body.n), area + shared
    touching = 1e-9 * min(_area(fa), _area(fb))
    if not area > touching:
        raise _apart(fa, fb, (a, b), where, gap)
    if gap is not None and area > TWICE * _area(fa):
        what = f"within {gap * 1e3:g} mm points of '{a}' face '{b}' more than once"
        raise DescriptionError(what, f"{where}.gap", "give a smaller gap, or name a surface of one layer")
    return Interface(matrix, area)


def _apart(fa: _Facets, fb: _Facets, names: tuple[str, str], where: str, gap: float | None) -> DescriptionError:
    """What to say of surfaces without common area."""
    both, check = f"'{names[0]}' and '{names[1]}'", "check positions, mesh_unit and surface names"
    nearest = float(cKDTree(fb.centre).query(fa.centre)[0].min())
    told = f"(nearest facet centres are {nearest:.3g} m apart)"
    if gap is not None:
        what = f"{both} face each other nowhere within {gap * 1e3:g} mm"
        return DescriptionError(what, f"{where}.gap", f"give the largest distance between them {told}, or {check}")
    remedy = f'fixed contacts join faces that lie on each other {told}: {check}; across a gap give gap = "2 mm"'
    return DescriptionError(f"{both} have no common area", where, remedy)


def _facets(body: BodyMesh, surface: str) -> _Facets:
    part_name, name = split_surface(surface)
    part, offset = body.part(part_name)
    nodes = facet_nodes(part, part.facets(name))
    corners = part.nodes[nodes[:, :3]]
    centre = corners.mean(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return _Facets(
        nodes + offset,
        corners,
        centre,
        np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1),
        normal / np.linalg.norm(normal, axis=1, keepdims=True),
    )


def _area(f: _Facets) -> float:
    edges = f.corners[:, 1:] - f.corners[:, :1]
    return float(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum() / 2)


def _facing(fa: _Facets, fb: _Facets, gap: float | None) -> np.ndarray:
    """Index pairs (k, 2) of facets that may overlap: near, facing each other, in one plane or in front of it."""
    reach = gap or 0.0
    near = cKDTree(fb.centre).query_ball_point(fa.centre, fa.radius + fb.radius.max() + reach)
    i = np.repeat(np.arange(len(fa.centre)), [len(n) for n in near])
    j = np.concatenate([np.asarray(n, dtype=int) for n in near]) if len(i) else i
    offset = fb.centre[j] - fa.centre[i]
    keep = (np.linalg.norm(offset, axis=1) < fa.radius[i] + fb.radius[j] + reach) & (
        np.einsum("kx,kx->k", fa.normal[i], fb.normal[j]) < -MIN_COSINE
    )
    if gap is None:
        distance = np.abs(np.einsum("kx,kx->k", offset, fa.normal[i]))
        keep &= distance < MAX_GAP * np.minimum(fa.radius[i], fb.radius[j])
    return np.column_stack([i[keep], j[keep]])


def common_areas(body: BodyMesh, a: str, b: str, gap: float | None = None) -> tuple[np.ndarray, np.ndarray]:
    """How much of every facet of `a` and of `b` [m^2], in the order of the surfaces' facets, faces the other surface.

    Nothing is assembled. Raises DescriptionError for an unknown surface.
    """
    fa, fb = _facets(body, a), _facets(body, b)
    of_a, of_b = np.zeros(len(fa.centre)), np.zeros(len(fb.centre))
    for i, j, _, area in _intersections(fa, fb, gap):
        of_a += np.bincount(i, area, len(of_a))
        of_b += np.bincount(j, area, len(of_b))
    return of_a, of_b


def common_pieces(
    body: BodyMesh, a: str, b: str, gap: float | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The area over which two surfaces face each other as k triangles: which facet of `a` and of `b` each is on (k,),
    in the order of the surfaces' facets, and its corners (k, 3, 6) in barycentric coordinates of both.
    """
    found = [(np.zeros(0, dtype=int), np.zeros(0, dtype=int), np.zeros((0, 3, 6)))]
    found += [pieces[:3] for pieces in _intersections(_facets(body, a), _facets(body, b), gap)]
    of_a, of_b, triangles = (np.concatenate(column) for column in zip(*found, strict=True))
    return of_a, of_b, triangles


def _intersections(
    fa: _Facets, fb: _Facets, gap: float | None
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
    """Of some pairs of facets at a time: the facets of A and of B (t,), the triangles and areas of `_common`."""
    pairs = _facing(fa, fb, gap)
    for start in range(0, len(pairs), PAIRS):
        i, j = pairs[start : start + PAIRS].T
        triangles, owner, area = _common(fa, fb, i, j, gap)
        yield i[owner], j[owner], triangles, area


def _intersect(
    fa: _Facets, fb: _Facets, i: np.ndarray, j: np.ndarray, gap: float | None
) -> tuple[np.ndarray, np.ndarray, float]:
    """Unknowns (t, 12), local matrices (t, 12, 12) and the area of the intersections of facet pairs."""
    triangles, owner, area = _common(fa, fb, i, j, gap)
    rule, weights = triangle_rule(4)
    at = np.einsum("qk,tkc->tqc", rule, triangles)
    jump = np.concatenate([p2_triangle(at[:, :, :3]), -p2_triangle(at[:, :, 3:])], axis=2)
    local = np.einsum("t,q,tqi,tqj->tij", area, weights, jump, jump, optimize=True)
    return np.concatenate([fa.nodes[i[owner]], fb.nodes[j[owner]]], axis=1), local, float(area.sum())


def _common(
    fa: _Facets, fb: _Facets, i: np.ndarray, j: np.ndarray, gap: float | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Intersections of facet pairs as triangles (t, 3, 6), the pair (t,) that each is of, its area (t,) m^2.

    Each corner of B's triangle carries its barycentric coordinates in A (projected along A's normal) and in B; both
    are linear, so clipping where A's turn negative keeps both along, and so does clipping where the distance from A's
    plane, linear too, leaves the gap.
    """
    a = fa.corners[i]
    edge_1, edge_2 = a[:, 1] - a[:, 0], a[:, 2] - a[:, 0]
    cross = np.cross(edge_1, edge_2)
    twice_area_2 = np.einsum("kx,kx->k", cross, cross)
    lever = fb.corners[j] - a[:, None, 0]  # (k, 3 corners, 3)
    l1 = np.einsum("kcx,kx->kc", np.cross(lever, edge_2[:, None]), cross) / twice_area_2[:, None]
    l2 = np.einsum("kcx,kx->kc", np.cross(edge_1[:, None], lever), cross) / twice_area_2[:, None]
    in_a = np.stack([1.0 - l1 - l2, l1, l2], axis=2)
    polygons = np.concatenate([in_a, np.broadcast_to(np.eye(3), in_a.shape)], axis=2)
    counts = np.full(len(i), 3)
    for side in range(3):
        polygons, counts = clip(polygons, counts, polygons[:, :, side])
    if gap is not None:
        off = np.einsum("kcx,kx->kc", lever, fa.normal[i])  # m in front of A, of B's corners
        inside = MAX_GAP * np.minimum(fa.radius[i], fb.radius[j])  # facetted cylinders may cut into each other
        for sign, reach in ((1.0, inside), (-1.0, np.full(len(i), gap * (1.0 + ROUNDED)))):
            distance = np.einsum("kvc,kc->kv", polygons[:, :, 3:], sign * off) + reach[:, None]
            polygons, counts = clip(polygons, counts, distance)
    triangles, owner = fan(polygons, counts)
    return triangles, owner, np.abs(np.linalg.det(triangles[:, :, :3])) * np.sqrt(twice_area_2[owner]) / 2.0
