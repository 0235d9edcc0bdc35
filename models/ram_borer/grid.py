"""Tetrahedra of rectangular castings without a mesher: the cells of a grid of planes that lie in given boxes.

Every cell is split into six tetrahedra along the same diagonal, so neighbours match. Outer faces are named by the
first region they lie in. Numpy only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, permutations

import numpy as np

TOLERANCE = 1e-6  # m
FACES = ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))  # of a tetrahedron

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Block:
    """A box by two opposite corners [m]."""

    low: Point
    high: Point


@dataclass(frozen=True)
class Region:
    """Outer faces that lie in a box [m], optionally only those whose outward normal is along `normal` ("+x", "-y")."""

    name: str
    low: Point
    high: Point
    normal: str = ""


@dataclass(frozen=True)
class Casting:
    """A union of blocks minus hollows. Planes [m] are lines of the grid; `refine` adds some between them."""

    name: str
    planes: tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
    solid: tuple[Block, ...]
    regions: tuple[Region, ...]
    rest: str  # name of the faces in no region
    hollow: tuple[Block, ...] = ()
    coarseness: float = 1.0  # cells are larger by this factor


@dataclass(frozen=True)
class Tetrahedra:
    """Linear tetrahedra and their named outer faces."""

    points: np.ndarray  # (n, 3) m
    cells: np.ndarray  # (m, 4)
    surfaces: dict[str, np.ndarray]  # name -> (k, 3) corner points


def refine(planes: Sequence[float], size: float) -> np.ndarray:
    """Planes [m] with equal steps of at most `size` between the given ones."""
    steps = [np.linspace(a, b, max(1, round((b - a) / size)) + 1)[:-1] for a, b in pairwise(planes)]
    return np.append(np.concatenate(steps), planes[-1])


def mesh(casting: Casting, size: float) -> Tetrahedra:
    """Mesh a casting with cells of about `size` [m]; where planes are nearer, as in walls, one cell stays one cell.

    Raises ValueError for a region without a face.
    """
    lines = [refine(p, size * casting.coarseness) for p in casting.planes]
    middles = [(a[1:] + a[:-1]) / 2 for a in lines]
    centre = np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1)

    def covered(blocks: Sequence[Block]) -> np.ndarray:
        found = np.zeros(centre.shape[:3], dtype=bool)
        for b in blocks:
            found |= np.all((centre > b.low) & (centre < b.high), axis=-1)
        return found

    i, j, k = np.nonzero(covered(casting.solid) & ~covered(casting.hollow))
    shape = tuple(len(a) for a in lines)
    corner = np.array([i, j, k])
    cells = []
    for order in permutations(range(3)):  # Kuhn: one tetrahedron for each way from the low to the high corner
        path, at = [np.ravel_multi_index(tuple(corner), shape)], corner.copy()
        for axis in order:
            at[axis] += 1
            path.append(np.ravel_multi_index(tuple(at), shape))
        cells.append(np.array(path).T)
    used, compact = np.unique(np.concatenate(cells), return_inverse=True)
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)[used]
    tetra = compact.reshape(-1, 4)
    return Tetrahedra(points, tetra, _named(casting, points, tetra))


def _named(casting: Casting, points: np.ndarray, tetra: np.ndarray) -> dict[str, np.ndarray]:
    faces = np.concatenate([tetra[:, f] for f in FACES])
    opposite = np.concatenate([tetra[:, 6 - sum(f)] for f in FACES])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    outer = first[count == 1]
    corners = points[faces[outer]]  # (k, 3, 3)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = np.einsum("kx,kx->k", normal, points[opposite[outer]] - corners[:, 0]) < 0
    normal = np.where(outward[:, None], normal, -normal)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    free = np.ones(len(outer), dtype=bool)
    surfaces = {}
    for region in casting.regions:
        low, high = np.array(region.low) - TOLERANCE, np.array(region.high) + TOLERANCE
        inside = free & np.all((corners >= low) & (corners <= high), axis=(1, 2))
        if region.normal:
            sign = 1.0 if region.normal[0] == "+" else -1.0
            inside &= sign * normal[:, "xyz".index(region.normal[1])] > 0.9
        if not inside.any():
            raise ValueError(f"{casting.name}: no face for the surface {region.name}")
        surfaces[region.name] = np.concatenate(
            [surfaces.get(region.name, np.zeros((0, 3), dtype=int)), faces[outer[inside]]]
        )
        free &= ~inside
    if free.any():
        surfaces[casting.rest] = faces[outer[free]]
    return surfaces
