"""Series solution of conduction through layers with contact resistance between films."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

GAUSS = np.polynomial.legendre.leggauss(200)


@dataclass(frozen=True)
class Layer:
    thickness: float  # m
    conductivity: float  # W/(m K)
    capacity: float  # J/(m^3 K)


@dataclass(frozen=True)
class Wall:
    """Layers from left to right, heated through the film at the left from zero on."""

    layers: tuple[Layer, ...]
    contact: float  # W/(m^2 K) between them
    left: float  # W/(m^2 K)
    right: float  # W/(m^2 K), to zero; 0: adiabatic

    def modes(self, rate: np.ndarray, at: tuple[np.ndarray, ...]) -> tuple[list[np.ndarray], np.ndarray]:
        """Of separation constants lambda (m,) [s^-1/2]: X (m, k) at distances from the left face of each layer, and
        what is left of the condition at the right end (m,)."""
        X, Q, fields = np.ones_like(rate), np.full_like(rate, self.left), []
        for i, (layer, x) in enumerate(zip(self.layers, at, strict=True)):
            if i:
                X = X + Q / self.contact
            a = rate * np.sqrt(layer.capacity / layer.conductivity)
            ka = layer.conductivity * a
            fields.append(X[:, None] * np.cos(np.outer(a, x)) + (Q / ka)[:, None] * np.sin(np.outer(a, x)))
            end = a * layer.thickness
            X, Q = X * np.cos(end) + Q / ka * np.sin(end), Q * np.cos(end) - X * ka * np.sin(end)
        return fields, Q + self.right * X

    def roots(self, count: int) -> np.ndarray:
        """The first separation constants (count,) [s^-1/2]."""
        nothing = tuple(np.zeros(0) for _ in self.layers)
        width = sum(w.thickness * np.sqrt(w.capacity / w.conductivity) for w in self.layers)
        grid = np.linspace(1e-6, (count + 2) * np.pi / width, 400 * count)
        rest = self.modes(grid, nothing)[1]
        low = np.flatnonzero(np.sign(rest[:-1]) != np.sign(rest[1:]))[:count]
        a, b = grid[low], grid[low + 1]
        below = np.sign(rest[low])
        for _ in range(60):
            middle = (a + b) / 2
            same = np.sign(self.modes(middle, nothing)[1]) == below
            a, b = np.where(same, middle, a), np.where(same, b, middle)
        return (a + b) / 2

    def steady(self, air: float, at: tuple[np.ndarray, ...]) -> list[np.ndarray]:
        """Series resistances: temperatures at distances from the left face of each layer."""
        if self.right == 0.0:
            return [np.full_like(x, air) for x in at]
        through = sum(w.thickness / w.conductivity for w in self.layers) + (len(self.layers) - 1) / self.contact
        flux = air / (1 / self.left + through + 1 / self.right)
        T, fields = air - flux / self.left, []
        for i, (layer, x) in enumerate(zip(self.layers, at, strict=True)):
            T = T - flux / self.contact if i else T
            fields.append(T - flux / layer.conductivity * x)
            T = T - flux * layer.thickness / layer.conductivity
        return fields

    def temperature(self, air: float, at: tuple[np.ndarray, ...], time: np.ndarray, count: int = 60) -> np.ndarray:
        """(n, k) of points in all layers at times (n,) [s], cold at first; air: beyond the film at the left."""
        rate = self.roots(count)
        points = tuple((GAUSS[0] + 1) / 2 * w.thickness for w in self.layers)
        weights = [GAUSS[1] / 2 * w.thickness * w.capacity for w in self.layers]
        X, T = self.modes(rate, points)[0], self.steady(air, points)
        norm = sum((x**2 * w).sum(axis=1) for x, w in zip(X, weights, strict=True))
        share = sum((x * t * w).sum(axis=1) for x, t, w in zip(X, T, weights, strict=True)) / norm
        wanted = np.hstack(self.modes(rate, at)[0])
        fading = np.exp(-np.outer(time, rate**2)) @ (share[:, None] * wanted)
        return np.asarray(np.concatenate(self.steady(air, at)) - fading)
