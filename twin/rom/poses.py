"""TCP error between the poses of the grid: tensor-product interpolation weights.

Displacements at poses are smooth functions of the axis positions apart from the kinks of eq (1) of paper 000 at the
stations. Three kinds, all exact at the nodes and for linear functions:

- "linear": multilinear, error h^2/8 max|f''|; never overshoots;
- "cubic": four nearest nodes, error of order h^4; continuous;
- "lagrange": one polynomial through all nodes; best on few nodes of a smooth function, and so the default; wild beyond
  about ten, so that axes with more than seven nodes fall back to "cubic".
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

Kind = Literal["linear", "cubic", "lagrange"]
_WINDOW = {"linear": 2, "cubic": 4, "lagrange": None}  # nodes used along an axis; None: all of them
MOST_LAGRANGE = 7  # nodes of an axis


def axis_weights(nodes: np.ndarray, s: np.ndarray, kind: Kind = "lagrange") -> np.ndarray:
    """Weights (m, n) of nodes (n,) [m], increasing, at coordinates s (m,) [m], clipped to the nodes' range.

    Lagrange polynomials over a window of nodes around s (fewer where the axis has fewer). Each row sums to 1.
    """
    nodes = np.asarray(nodes, dtype=float)
    s = np.clip(np.asarray(s, dtype=float), nodes[0], nodes[-1])
    n = len(nodes)
    size = min(_WINDOW[kind if n <= MOST_LAGRANGE or kind == "linear" else "cubic"] or n, n)
    cell = np.clip(np.searchsorted(nodes, s, side="right") - 1, 0, max(n - 2, 0))
    window = np.clip(cell - (size - 2) // 2, 0, n - size)[:, None] + np.arange(size)  # (m, size)
    x = nodes[window]
    weights = np.zeros((len(s), n))
    for i in range(size):
        others = [j for j in range(size) if j != i]
        value = np.prod([(s - x[:, j]) / (x[:, i] - x[:, j]) for j in others], axis=0) if others else np.ones(len(s))
        weights[np.arange(len(s)), window[:, i]] = value
    return weights


def pose_weights(
    grid: Sequence[np.ndarray], position: np.ndarray, kind: Kind = "lagrange"
) -> tuple[np.ndarray, np.ndarray]:
    """Weights (m, n_poses) on the C-ordered grid at positions (m, n_axes) [m], and where they lie outside it (m,) bool.

    Outside, the value at the nearest point of the grid is taken: the caller flags it.
    """
    position = np.atleast_2d(np.asarray(position, dtype=float))
    weights = np.ones((len(position), 1))
    for nodes, s in zip(grid, position.T, strict=True):
        along = axis_weights(nodes, s, kind)
        weights = (weights[:, :, None] * along[:, None, :]).reshape(len(position), weights.shape[1] * along.shape[1])
    return weights, outside_grid(grid, position)


def outside_grid(grid: Sequence[np.ndarray], position: np.ndarray) -> np.ndarray:
    """(m,) bool: which positions (m, n_axes) [m] lie beyond the poses of a grid along any axis."""
    outside = np.zeros(len(position), dtype=bool)
    for nodes, s in zip(grid, position.T, strict=True):
        margin = 1e-9 * max(abs(nodes[0]), abs(nodes[-1]))
        outside |= (s < nodes[0] - margin) | (s > nodes[-1] + margin)
    return outside
