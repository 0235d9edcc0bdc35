"""Clipping of many convex polygons at once, and their quadrature.

Polygons are rows of vertices in some plane: (m, k, d) padded with anything, and counts (m,) of valid vertices.
"""

from __future__ import annotations

import numpy as np
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri


def clip(polygons: np.ndarray, counts: np.ndarray, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The parts of convex polygons (m, k, d) where `distance` (m, k), linear over each polygon, is >= 0.

    Sutherland-Hodgman, one half-plane. Returns polygons (m, k + 1, d) and counts; 0 where nothing is left.
    """
    m, k, d = polygons.shape
    row = np.arange(m)
    kept = np.zeros((m, 2 * k, d))
    valid = np.zeros((m, 2 * k), dtype=bool)
    for i in range(k):
        exists = i < counts
        following = np.where(i + 1 < counts, i + 1, 0)
        a, b = polygons[:, i], polygons[row, following]
        da, db = distance[:, i], distance[row, following]
        kept[:, 2 * i] = a
        valid[:, 2 * i] = exists & (da >= 0)
        crosses = exists & ((da > 0) & (db < 0) | (da < 0) & (db > 0))
        span = np.where(crosses, da - db, 1.0)
        kept[:, 2 * i + 1] = a + (da / span)[:, None] * (b - a)
        valid[:, 2 * i + 1] = crosses
    order = np.argsort(~valid, axis=1, kind="stable")[:, : k + 1]
    counts = valid.sum(axis=1)
    return kept[row[:, None], order], np.where(counts >= 3, counts, 0)


def fan(polygons: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (t, 3, d) that make up convex polygons, and the polygon each comes from (t,)."""
    k = polygons.shape[1]
    triangles, owner = [], []
    for i in range(1, k - 1):
        rows = np.flatnonzero(counts > i + 1)
        triangles.append(np.stack([polygons[rows, 0], polygons[rows, i], polygons[rows, i + 1]], axis=1))
        owner.append(rows)
    return np.concatenate(triangles), np.concatenate(owner)


def triangle_rule(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Barycentric points (q, 3) and weights (q,), which sum to 1, exact for polynomials up to `degree`."""
    points, weights = get_quadrature(RefTri, degree)
    return np.column_stack([1.0 - points.sum(axis=0), points[0], points[1]]), 2.0 * weights


def p2_triangle(barycentric: np.ndarray) -> np.ndarray:
    """The six quadratic shape functions (..., 6) at barycentric coordinates (..., 3): corners 0 1 2, edges 01 12 20."""
    a, b, c = np.moveaxis(barycentric, -1, 0)
    return np.stack([a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * c * a], axis=-1)


def p2_triangle_gradient(barycentric: np.ndarray) -> np.ndarray:
    """Derivatives (..., 6, 2) of `p2_triangle` along barycentric 1 and 2, with 0 taking up the rest."""
    a, b, c = np.moveaxis(barycentric, -1, 0)
    zero = np.zeros_like(a)
    by_b = np.stack([1 - 4 * a, 4 * b - 1, zero, 4 * (a - b), 4 * c, -4 * c], axis=-1)
    by_c = np.stack([1 - 4 * a, zero, 4 * c - 1, -4 * b, 4 * b, 4 * (a - c)], axis=-1)
    return np.stack([by_b, by_c], axis=-1)
