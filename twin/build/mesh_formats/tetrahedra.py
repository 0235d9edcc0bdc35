"""Solids of any shape as tetrahedra that fit each other, and their named faces as triangles.

Every solid is divided into the cones from its lowest-numbered corner to the sides that do not meet there, and every
four-sided side by the diagonal from its own lowest-numbered corner. Both solids that share a side divide it alike, so
no point is added and nothing gapes (Dompierre, Labbe, Vallet, Camarero, "How to subdivide pyramids, prisms and
hexahedra into tetrahedra", 1999). Of solids with mid-edge nodes the middle of a diagonal lies where the solid's own
serendipity map has it. Flat-sided solids keep their shape exactly; a warped side of a solid without mid-edge nodes
becomes two triangles.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.build.mesh_formats.solid_file import SHAPES, Array, Solids

FARTHEST = 0.35  # of an edge's length, that its middle node lies off the middle of its chord: an arc of 140 degrees
_EDGES = np.array(SHAPES["tetra"].edges)
_OPPOSITE = np.array([6, 7, 4, 5, 2, 3, 0, 1])  # of the corners of a hexahedron


def triangles(sides: Array) -> Array:
    """(m, 3) or (m, 4) corner points as triangles, four-sided ones cut from their lowest-numbered corner."""
    if sides.shape[1] == 3:
        return sides
    turn = (sides.argmin(axis=1)[:, None] + np.arange(4)) % 4
    turned = np.take_along_axis(sides, turn, axis=1)
    return np.vstack([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])


def tetrahedra(points: Array, solids: Sequence[Solids]) -> tuple[Array, Array]:
    """Points (n', 3) and tetrahedra (m, 4), or (m, 10) where a solid has mid-edge nodes, in VTK order.

    Missing middles (-1), and those of solids without any beside others that have them, are those of a neighbour, else
    the middle of the edge.
    """
    corners = np.vstack([_cones(s) for s in solids])
    corners = _right_handed(points, corners)
    return _with_middles(points, corners, solids) if any(s.quadratic for s in solids) else (points, corners)


def check_middles(points: Array, solids: Solids) -> None:
    """Raises ValueError where mid-edge nodes are not near the middle of their edges: a writer with another order."""
    shape = SHAPES[solids.shape]
    if solids.quadratic:
        middles = solids.cells[:, shape.corners :]
        given = middles >= 0
        ends = solids.corners[:, np.array(shape.edges)][given]
        a, b = points[ends[:, 0]], points[ends[:, 1]]
        off = np.linalg.norm(points[middles[given]] - (a + b) / 2, axis=1)
        if far := int((off > FARTHEST * np.linalg.norm(b - a, axis=1)).sum()):
            raise ValueError(f"{far} mid-edge nodes lie far from the middle of their edge: their order is not known")


def _cones(solids: Solids) -> Array:
    """(m, 4) corner points."""
    cells = solids.corners
    if solids.shape == "tetra":
        return cells
    apex = cells.argmin(axis=1)
    pieces = []
    for side in SHAPES[solids.shape].sides:
        away = ~np.isin(apex, side)
        facing = triangles(cells[away][:, list(side)])
        tip = cells[away, apex[away]]
        pieces.append(np.column_stack([np.tile(tip, len(facing) // max(len(tip), 1)), facing]))
    return np.vstack(pieces)


def _right_handed(points: Array, corners: Array) -> Array:
    at = points[corners]
    edge = at[:, 1:] - at[:, :1]
    left = np.einsum("mi,mi->m", np.cross(edge[:, 0], edge[:, 1]), edge[:, 2]) < 0
    corners = corners.copy()
    corners[left] = corners[left][:, [0, 1, 3, 2]]
    return corners


def _with_middles(points: Array, corners: Array, solids: Sequence[Solids]) -> tuple[Array, Array]:
    n = len(points)
    wanted, numbers = np.unique(_keys(corners[:, _EDGES], n), return_inverse=True)
    ends = np.stack([wanted // n, wanted % n], axis=1)
    middle = np.full(len(wanted), -1)
    for s in solids:
        if s.quadratic:
            given = s.cells[:, SHAPES[s.shape].corners :]
            place = np.searchsorted(wanted, _keys(s.corners[:, np.array(SHAPES[s.shape].edges)], n))
            middle[place[given >= 0]] = given[given >= 0]
    given = np.flatnonzero(middle >= 0)
    at = points[ends].mean(axis=1)
    at[given] = points[middle[given]]
    centres = [pair for s in solids for pair in _diagonals(points, wanted, at, s)]  # all of `at` before any is moved
    for keys, centre in centres:
        at[np.searchsorted(wanted, keys)] = centre
    new = np.flatnonzero(middle < 0)
    middle[new] = n + np.arange(len(new))
    return np.vstack([points, at[new]]), np.column_stack([corners, middle[numbers.reshape(-1, 6)]])


def _diagonals(points: Array, wanted: Array, at: Array, solids: Solids) -> list[tuple[Array, Array]]:
    """(keys, middles) of the diagonals of sides and of the inside, from the middles `at` of the edges `wanted`.

    Serendipity elements: at the centre of a four-sided side half the sum of its middles less a quarter of its corners';
    at the centre of a hexahedron a quarter of the sum of its middles less a quarter of its corners'.
    """
    shape, cells, n = SHAPES[solids.shape], solids.corners, len(points)
    found = []
    for side in (np.array(s) for s in shape.sides if len(s) == 4):
        rim = _keys(cells[:, np.stack([side, np.roll(side, -1)], axis=1)], n)
        start = cells[:, side].argmin(axis=1) % 2
        diagonal = np.stack([cells[np.arange(len(cells)), side[start + k]] for k in (0, 2)], axis=1)
        middles = at[np.searchsorted(wanted, rim)]
        found.append((_keys(diagonal, n), middles.sum(axis=1) / 2 - points[cells[:, side]].sum(axis=1) / 4))
    if solids.shape == "hexahedron":
        apex = cells.argmin(axis=1)
        diagonal = np.stack([cells[np.arange(len(cells)), k] for k in (apex, _OPPOSITE[apex])], axis=1)
        middles = at[np.searchsorted(wanted, _keys(cells[:, np.array(shape.edges)], n))]
        found.append((_keys(diagonal, n), (middles.sum(axis=1) - points[cells].sum(axis=1)) / 4))
    return found


def _keys(ends: Array, n: int) -> Array:
    """One number per edge, whatever its direction; ends (..., 2)."""
    return ends.min(axis=-1) * n + ends.max(axis=-1)
