"""Functions of the place on a bearing, and displacements fitted by them: what holds turned parts (`rom.turning`).

Polynomials up to DEGREE in the distance from the axis, along it and round it, f(rho, z) cos(m phi) and sin(m phi): a
rotation about the axis mixes only the two of a pair. Those that others make up on the bearing are left out (on a plane
all with z, on a cylinder all with the square of rho). Displacements are fitted over the area by least squares, so that
rigid motions are told exactly whatever its outline: moments of a square's would differ when it has turned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.build.interface import common_pieces
from twin.build.mesh import BodyMesh, PartMesh
from twin.build.surface import SurfacePoints, facet_nodes, surface_points
from twin.errors import DescriptionError
from twin.machine.bodies import split_surface

DEGREE = 3  # of the polynomials; benchmark `turned` says what is left
SAME = 1e-6  # of a function: what is left of it beside the others, below which they make it up


@dataclass(frozen=True)
class Side:
    """One side of a bearing."""

    part: str
    nodes: np.ndarray  # (m,) unknowns of the part
    values: np.ndarray  # (k, m) 1: coefficients of the functions, fitted to N


def bearing_sides(
    body: BodyMesh, pairs: Sequence[tuple[str, str]], point: np.ndarray, direction: np.ndarray, where: str
) -> tuple[np.ndarray, list[Side], list[Side]]:
    """Harmonics (k,) of the functions, and how they fit displacements of the inner and the outer surfaces of a bearing.

    body: uncut, with both; pairs: "part.surface" inner and outer of every fixed contact; point (3,) m on the axis.
    Raises DescriptionError where no contact has a common area.
    """
    inner, outer = common_points(body, pairs, where)
    functions = _Functions.over([at for _, at in inner], point, _frame(direction))
    gram = np.sum([_products(at, functions) for _, at in inner], axis=0)
    sides = [[_side(part, at, functions, gram) for part, at in own] for own in (inner, outer)]
    return functions.harmonics, sides[0], sides[1]


Points = list[tuple[PartMesh, SurfacePoints]]


def common_points(body: BodyMesh, pairs: Sequence[tuple[str, str]], where: str) -> tuple[Points, Points]:
    """Quadrature points of the common area of surfaces that lie on each other, of the first and the second of a pair.

    Raises DescriptionError where there is no common area.
    """
    inner, outer = [], []
    for a, b in pairs:
        of_a, of_b, triangles = common_pieces(body, a, b)
        inner.append(_points(body, a, of_a, triangles[:, :, :3]))
        outer.append(_points(body, b, of_b, triangles[:, :, 3:]))
    if not sum(float(at.weight.sum()) for _, at in inner) > 0.0:
        raise DescriptionError("its two sides have no common area", where, "a bearing is where they lie on each other")
    return inner, outer


@dataclass(frozen=True)
class _Functions:
    point: np.ndarray
    frame: np.ndarray  # (3, 3) rows: two across the axis, the axis
    middle: float  # m along the axis
    size: float  # m
    powers: tuple[np.ndarray, ...]  # per m: (n, 2) exponents of rho and z
    weights: tuple[np.ndarray, ...]  # per m: (n_functions, n)

    @classmethod
    def over(cls, points: Sequence[SurfacePoints], point: np.ndarray, frame: np.ndarray) -> _Functions:
        """Orthonormal over the points."""
        x = (np.concatenate([at.x.reshape(-1, 3) for at in points]) - point) @ frame.T
        w = np.concatenate([at.weight.ravel() for at in points])
        middle = float(w @ x[:, 2] / w.sum())
        rho, z = np.hypot(x[:, 0], x[:, 1]), x[:, 2] - middle
        size = float(np.sqrt(w @ (rho**2 + z**2) / w.sum()))
        powers, weights = [], []
        for m in range(DEGREE + 1):
            own = np.array([(n, j) for n in range(m, DEGREE + 1, 2) for j in range(DEGREE + 1 - n)])
            f = (rho[:, None] / size) ** own[:, 0] * (z[:, None] / size) ** own[:, 1]
            gram = (f * w[:, None]).T @ f / w.sum()
            powers.append(own)
            weights.append(_orthonormal(gram))
        return cls(point, frame, middle, size, tuple(powers), tuple(weights))

    @property
    def harmonics(self) -> np.ndarray:
        return np.array([m for m, own in enumerate(self.weights) for _ in own for _ in range(2 if m else 1)])

    def at(self, x: np.ndarray) -> np.ndarray:
        """(k, ...) at points (..., 3) m."""
        local = (x - self.point) @ self.frame.T
        rho, phi = np.hypot(local[..., 0], local[..., 1]) / self.size, np.arctan2(local[..., 1], local[..., 0])
        z = (local[..., 2] - self.middle) / self.size
        found = []
        for m, (powers, weights) in enumerate(zip(self.powers, self.weights, strict=True)):
            terms = np.array([rho**n * z**j for n, j in powers])
            for f in np.tensordot(weights, terms, 1):
                found += [f * np.cos(m * phi), f * np.sin(m * phi)] if m else [f]
        return np.array(found)


def _orthonormal(gram: np.ndarray) -> np.ndarray:
    """(k, n) rows of functions that are orthonormal in a Gram matrix (n, n), in the order of the terms."""
    rows: list[np.ndarray] = []
    for k, own in enumerate(np.eye(len(gram))):
        rest = own
        for _ in range(2):  # once more against rounding
            rest = rest - sum(((row @ gram @ rest) * row for row in rows), np.zeros(len(gram)))
        size = float(rest @ gram @ rest)
        if size > SAME * max(float(gram[k, k]), SAME):
            rows.append(rest / np.sqrt(size))
    return np.array(rows).reshape(-1, len(gram))


def _frame(direction: np.ndarray) -> np.ndarray:
    first = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    first = first / np.linalg.norm(first)
    return np.array([first, np.cross(direction, first), direction])


def _points(body: BodyMesh, surface: str, facets: np.ndarray, pieces: np.ndarray) -> tuple[PartMesh, SurfacePoints]:
    name, face = split_surface(surface)
    part, _ = body.part(name)
    nodes = facet_nodes(part, part.facets(face))[facets]
    return part, surface_points(part, nodes, pieces, max(2 + DEGREE, 2 * DEGREE))


def _products(at: SurfacePoints, functions: _Functions) -> np.ndarray:
    """(k, k) m^2: integrals of the products of the functions."""
    f = functions.at(at.x)
    return np.asarray(np.einsum("kmq,lmq,mq->kl", f, f, at.weight))


def _side(part: PartMesh, at: SurfacePoints, functions: _Functions, gram: np.ndarray) -> Side:
    nodes, inverse = np.unique(at.nodes, return_inverse=True)
    local = np.einsum("kmq,mq,mqi->kmi", functions.at(at.x), at.weight, at.shape)
    moments = np.array([np.bincount(inverse.ravel(), own.ravel(), nodes.size) for own in local])
    return Side(part.name, nodes, np.linalg.solve(gram, moments))
