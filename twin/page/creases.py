"""The edges of a surface that are drawn: its creases and borders."""

from __future__ import annotations

import numpy as np

CREASE = 0.8  # cosine of the angle between two faces below which the edge between them is drawn


def creases(nodes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Pairs of nodes (k, 2) between faces that meet at an angle, and at borders."""
    a, b, c = (nodes[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-30)[:, None]
    pairs = np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    owner = np.tile(np.arange(len(triangles)), 3)
    order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    pairs, owner = pairs[order], owner[order]
    start = np.flatnonzero(np.r_[True, np.any(np.diff(pairs, axis=0), axis=1)]) if len(pairs) else np.zeros(0, int)
    count = np.diff(np.r_[start, len(pairs)])
    second = np.minimum(start + 1, len(pairs) - 1)
    sharp = np.abs(np.einsum("ij,ij->i", normal[owner[start]], normal[owner[second]])) < CREASE  # windings differ
    kept: np.ndarray = pairs[start[(count != 2) | sharp]]
    return kept
