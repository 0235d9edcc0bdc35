"""Where the nodes of a network stand on paper: distances on paper as steps between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse.csgraph import shortest_path

ROUNDS = 300  # of majorisation; it stops moving long before for the tens of nodes of a machine
APART = 1.5  # times the longest distance: how far pieces that nothing joins stand from each other


def layout(n: int, links: Sequence[tuple[int, int]]) -> np.ndarray:
    """(n, 2) places of n nodes, the longer direction to the right; the same for the same network.

    Stress majorisation (Gansner, Koren, North, Graph Drawing 2004) from a circle: a spectral layout was rejected, as it
    puts all leaves of a node on one point, and machines are full of leaves.
    """
    if n < 2:
        return np.zeros((n, 2))
    graph = np.zeros((n, n))
    for a, b in links:
        graph[a, b] = graph[b, a] = 1.0
    distance = shortest_path(graph, unweighted=True, directed=False)
    joined = np.isfinite(distance)
    distance = np.where(joined, distance, APART * distance[joined].max(initial=1.0))
    weight = np.where(np.eye(n) > 0.0, 0.0, 1.0 / np.maximum(distance, 1e-9) ** 2)
    angle = 2.0 * np.pi * np.arange(n) / n
    x = 0.5 * distance.max() * np.stack([np.cos(angle), 0.9 * np.sin(angle)], axis=1)
    L = np.diag(weight.sum(axis=1)) - weight + np.full((n, n), 1.0 / n)
    inverse = np.linalg.inv(L)
    for _ in range(ROUNDS):
        apart = np.linalg.norm(x[:, None] - x, axis=2) + np.eye(n)
        pull = weight * distance / np.maximum(apart, 1e-9)
        x = inverse @ ((np.diag(pull.sum(axis=1)) - pull) @ x)
    x = x - x.mean(axis=0)
    _, _, axes = np.linalg.svd(x, full_matrices=False)
    turned = x @ axes.T
    return turned * np.where(turned.sum(axis=0) < -1e-9, -1.0, 1.0)
