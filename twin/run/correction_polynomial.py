"""Polynomials over the workspace that a control can evaluate in its interpolation cycle (paper 001, eqs 16.1, 16.2).

Positions are normalised per axis, s = (position - centre) / half_range in [-1, 1]: in millimetres the 27 monomials of
a metre's stroke have a condition number of 1e18, normalised 34 (E-001-2). Two forms:

- "full": sum of c_ijk s_x^i s_y^j s_z^k, the tensor product. Three poses per axis are met exactly by parabolas.
- "product": (a0 + a1 s_x + ..) (b0 + b1 s_y + ..) (..), eq (16.1) as printed. It has 7 free numbers where 27 poses ask
  for 27, so it is a compression with an error of its own (E-001-1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.errors import TwinError

SWEEPS = 500  # alternating least squares stops earlier, when nothing moves any more
STARTS = 8  # it may end in a local optimum: the best of some starts is taken


@dataclass(frozen=True)
class NormalisedAxis:
    """An axis of the workspace and the degree of the polynomial along it."""

    name: str
    centre: float  # m
    half_range: float  # m, > 0
    degree: int  # >= 0

    def powers(self, position: np.ndarray) -> np.ndarray:
        """s^0 .. s^degree (m, degree + 1) at positions (m,) [m], held at the ends of the range outside it.

        A polynomial of degree four leaves its range steeply: beyond the last pose its value there is the better guess.
        """
        s = np.clip((np.asarray(position, dtype=float) - self.centre) / self.half_range, -1.0, 1.0)
        return s[:, None] ** np.arange(self.degree + 1)


@dataclass(frozen=True)
class Polynomial:
    """Several components over the same axes."""

    axes: tuple[NormalisedAxis, ...]
    coefficients: np.ndarray  # (n_components, degree_1 + 1, degree_2 + 1, ...), unit of the values

    def __call__(self, position: np.ndarray) -> np.ndarray:
        """Values (m, n_components) at positions (m, n_axes) [m]."""
        value = self.coefficients[None]
        for axis, s in zip(reversed(self.axes), np.asarray(position, dtype=float).T[::-1], strict=True):
            value = np.einsum("m...k,mk->m...", np.broadcast_to(value, (len(s), *value.shape[1:])), axis.powers(s))
        return value

    def at(self, position: Sequence[float]) -> np.ndarray:
        """Values (n_components,) at one position [m]: the shortest way, as a control goes it."""
        value = self.coefficients
        for axis, p in zip(self.axes[::-1], position[::-1], strict=True):
            s = (p - axis.centre) / axis.half_range
            s = 1.0 if s > 1.0 else -1.0 if s < -1.0 else s
            powers = (1.0, s, s * s) if axis.degree == 2 else tuple(s**k for k in range(axis.degree + 1))
            value = value.reshape(-1, len(powers)).dot(np.array(powers))
        return value


@dataclass(frozen=True)
class ProductForm:
    """Per component one factor per axis."""

    axes: tuple[NormalisedAxis, ...]
    factors: tuple[tuple[np.ndarray, ...], ...]  # [component][axis] (degree + 1,); the first factor has the unit

    def expanded(self) -> Polynomial:
        """The same function as a full polynomial, whose coefficients then are products."""
        components = []
        for factors in self.factors:
            value = np.array(1.0)
            for factor in factors:
                value = np.multiply.outer(value, factor)
            components.append(value)
        return Polynomial(self.axes, np.array(components))


def normalised_axes(names: Sequence[str], poses: np.ndarray, degrees: Sequence[int]) -> tuple[NormalisedAxis, ...]:
    """Axes whose range is that of the poses (n_poses, n_axes) [m].

    An axis with a single position has half_range 1 and needs degree 0. Raises TwinError for a degree that the number of
    positions cannot settle.
    """
    axes = []
    for name, positions, degree in zip(names, poses.T, degrees, strict=True):
        count = len(np.unique(positions))
        if degree + 1 > count:
            raise TwinError(
                f"degree {degree} along axis '{name}' needs {degree + 1} positions, the poses have {count}",
                "--degree",
                f"write --degree {count - 1} or lower, or build with more poses (`poses` in machine.toml)",
            )
        low, high = float(positions.min()), float(positions.max())
        axes.append(NormalisedAxis(name, (low + high) / 2, (high - low) / 2 if high > low else 1.0, degree))
    return tuple(axes)


def design_matrix(axes: Sequence[NormalisedAxis], poses: np.ndarray) -> np.ndarray:
    """All products of powers (n_poses, n_coefficients) at poses (n_poses, n_axes) [m], the last axis fastest."""
    matrix = np.ones((len(poses), 1))
    for axis, positions in zip(axes, poses.T, strict=True):
        matrix = (matrix[:, :, None] * axis.powers(positions)[:, None, :]).reshape(len(poses), -1)
    return matrix


def fit_full(axes: tuple[NormalisedAxis, ...], poses: np.ndarray, values: np.ndarray) -> Polynomial:
    """The tensor-product polynomial of values (n_poses, n_components) at poses (n_poses, n_axes) [m].

    Least squares where there are more poses than coefficients, exact where there are as many.
    Raises TwinError where the poses cannot tell the coefficients apart.
    """
    matrix = design_matrix(axes, poses)
    coefficients, _, rank, _ = np.linalg.lstsq(matrix, values, rcond=None)
    if rank < matrix.shape[1]:
        what = f"{len(poses)} poses settle {rank} of {matrix.shape[1]} coefficients"
        raise TwinError(what, "--degree", "lower the degree, or build with poses on a full grid")
    return Polynomial(axes, coefficients.T.reshape(values.shape[1], *(a.degree + 1 for a in axes)))


def fit_without_constant(axis: NormalisedAxis, zero: float, poses: np.ndarray, values: np.ndarray) -> Polynomial:
    """Eq (16.2): a polynomial along one axis that is zero at position `zero` [m], where the fixed bearing sits.

    a1 z + .. + an z^n with z from `zero`, written in the normalised coordinate s: the span of s^k - s_zero^k, k = 1 ..
    degree. Right only where the bearing does not move; `fit_full` has a constant for what moves it (E-001-3).
    poses (n_poses, 1) [m], values (n_poses, n_components). `zero` may lie outside the range of the poses.
    Raises TwinError where the poses cannot tell the coefficients apart.
    """
    s_zero = (zero - axis.centre) / axis.half_range
    shift = s_zero ** np.arange(1, axis.degree + 1)
    matrix = axis.powers(poses[:, 0])[:, 1:] - shift
    higher, _, rank, _ = np.linalg.lstsq(matrix, values, rcond=None)
    if rank < axis.degree:
        what = f"{len(poses)} poses settle {rank} of {axis.degree} coefficients"
        raise TwinError(what, "--degree", "lower the degree, or build with more poses")
    return Polynomial((axis,), np.vstack([-shift @ higher, higher]).T)


def fit_product(axes: tuple[NormalisedAxis, ...], poses: np.ndarray, values: np.ndarray) -> ProductForm:
    """The best product form in least squares, component by component. Arguments as for `fit_full`.

    Alternating least squares: all factors but one are held, which leaves a linear problem for that one.
    """
    powers = [axis.powers(p) for axis, p in zip(axes, poses.T, strict=True)]
    rng = np.random.default_rng(0)
    factors = []
    for column in values.T:
        size = float(np.abs(column).max())
        ones = [np.eye(axis.degree + 1)[0] for axis in axes]
        starts = [ones] + [[rng.standard_normal(len(f)) for f in ones] for _ in range(STARTS - 1)]
        tried = [_alternate(powers, column / (size or 1.0), start) for start in starts]
        best = min(tried, key=lambda t: t[0])[1]
        factors.append((best[0] * size, *best[1:]))
    return ProductForm(axes, tuple(factors))


def _alternate(
    powers: list[np.ndarray], column: np.ndarray, factors: list[np.ndarray]
) -> tuple[float, list[np.ndarray]]:
    """Sum of squares and factors where alternating least squares comes to rest."""
    factors, before = list(factors), np.inf
    for _ in range(SWEEPS):
        for i, own in enumerate(powers):
            others = np.ones(len(column))
            for j, (p, f) in enumerate(zip(powers, factors, strict=True)):
                if j != i:
                    others = others * (p @ f)
            factors[i] = np.linalg.lstsq(own * others[:, None], column, rcond=None)[0]
            if i:  # the first factor carries the size
                length = float(np.linalg.norm(factors[i]))
                if length > 0.0:
                    factors[i], factors[0] = factors[i] / length, factors[0] * length
        product = np.prod([p @ f for p, f in zip(powers, factors, strict=True)], axis=0)
        rest = float(((column - product) ** 2).sum())
        if before - rest <= 1e-15:  # of a column scaled to at most 1
            break
        before = rest
    return rest, factors
