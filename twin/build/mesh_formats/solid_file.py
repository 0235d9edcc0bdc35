"""What a mesh file holds: solids of any shape, and named faces. Local nodes are in the order of VTK throughout."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

Array = np.ndarray
Faces = Mapping[str, Sequence[Array]]  # name -> pieces (m, 3) or (m, 4) of corner points


@dataclass(frozen=True)
class Shape:
    """Corners, edges (in the order of the mid-edge nodes that follow the corners) and sides of one kind of solid."""

    corners: int
    edges: tuple[tuple[int, int], ...]
    sides: tuple[tuple[int, ...], ...]

    @property
    def nodes(self) -> int:
        """With mid-edge nodes."""
        return self.corners + len(self.edges)


SHAPES: dict[str, Shape] = {
    "tetra": Shape(4, ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)), ((0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3))),
    "pyramid": Shape(
        5,
        ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)),
        ((0, 1, 2, 3), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    ),
    "wedge": Shape(
        6,
        ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
        ((0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    ),
    "hexahedron": Shape(
        8,
        ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
        ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    ),
}


@dataclass(frozen=True)
class Solids:
    """Solids of one shape: corners (m, corners), and with mid-edge nodes (m, nodes); -1 where one is missing."""

    shape: str
    cells: Array

    @property
    def corners(self) -> Array:
        return self.cells[:, : SHAPES[self.shape].corners]

    @property
    def quadratic(self) -> bool:
        return self.cells.shape[1] == SHAPES[self.shape].nodes


@dataclass(frozen=True)
class SolidFile:
    """Points (n, 3) in the file's unit, solids, and its named faces in tiers, the most explicit way of naming first."""

    points: Array
    solids: tuple[Solids, ...]
    faces: tuple[Faces, ...]
    found: tuple[str, ...] = ()  # kinds of cells in the file, for messages


def outer_sides(solids: Sequence[Solids]) -> dict[int, Array]:
    """Corners of the sides that belong to one solid only, by their number: {3: (m, 3), 4: (m, 4)}, unordered."""
    found: dict[int, Array] = {}
    for count in (3, 4):
        pieces = [s.corners[:, list(side)] for s in solids for side in SHAPES[s.shape].sides if len(side) == count]
        if not pieces:
            continue
        sides = np.vstack(pieces)
        _, first, times = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
        found[count] = sides[first[times == 1]]
    return found


def sides_within(outer: Mapping[int, Array], nodes: Array) -> list[Array]:
    """The outer sides all of whose corners are among `nodes`: what a set of nodes says of surfaces."""
    return [sides[np.isin(sides, nodes).all(axis=1)] for sides in outer.values()]


def from_numbers(numbers: Array, wanted: Array) -> Array:
    """Indices of the file's own numbers `wanted` (any shape) among `numbers`; 0 and what is negative become -1.

    Raises ValueError for a number that is not there.
    """
    order = np.argsort(numbers, kind="stable")
    place = np.searchsorted(numbers, wanted, sorter=order)
    place[place == len(numbers)] = 0
    index = order[place] if len(numbers) else np.full(wanted.shape, -1)
    unknown = (wanted > 0) & ((numbers[index] if len(numbers) else np.full(wanted.shape, -1)) != wanted)
    if unknown.any():
        raise ValueError(f"number {wanted[unknown][0]} is used and not defined")
    return np.where(wanted > 0, index, -1)
