"""Laws that follow the machine: film coefficients by surface temperature, winding losses by winding temperature.

A law that reads a temperature of the model is tabulated per step over that temperature, with all load samples of the
step averaged (powers and coefficients, never speeds before a nonlinear law). Inside the step the table is read at the
temperature at the step's start: lagged one step (paper 004, Fig. 5), while the film itself stays implicit (erratum
E-000-3). Evaluating the law at mean loads inside the step was rejected: 20 % duty is not a fifth of the speed.

Functions take numpy and JAX arrays alike (`xp` is numpy or jax.numpy): the full model, the compact model and the
runtime read the very same tables.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.physics.radiation import radiation_coefficient
from twin.rom.load_model import LoadModel

Array = Any

# Share by which coefficients may leave those in a factor before a new one is made, offline and at the edge alike.
FOLLOW = 0.2

# Surface minus ambient: uniform in the fourth root, in which free convection (Nu ~ Ra^(1/4)) is linear.
WIDEST = 100.0  # K
SMALL = 1e-6  # K, below which the root is linear in it, so that its derivative is finite where both are equally warm
_HALF = 32
DIFFERENCES = np.sign(np.arange(-_HALF, _HALF + 1)) * (np.arange(-_HALF, _HALF + 1) / _HALF) ** 4 * WIDEST
# Temperature of a source's surface: copper is linear in it, viscosity changes by 1 % between two points.
TEMPERATURES = np.linspace(-50.0, 250.0, 121)


@dataclass(frozen=True)
class Following:
    """Laws tabulated per step; k laws, n steps."""

    index: tuple[int, ...]  # of the films or sources, in the order of LoadModel
    grid: np.ndarray  # (m,) DIFFERENCES [K] or TEMPERATURES [degC]
    value: np.ndarray  # (n, k, m) W/(m^2 K) or W, gains included
    outside: np.ndarray  # (n, k, m) bool: outside the validity of the law at some sample of the step

    @classmethod
    def none(cls, n_steps: int, grid: np.ndarray) -> Following:
        """Nothing follows."""
        shape = (n_steps, 0, len(grid))
        return cls((), grid, np.zeros(shape), np.zeros(shape, dtype=bool))


def difference_place(xp: Any, difference: Array) -> Array:
    """Place in DIFFERENCES (0 .. 64) of a surface minus ambient temperature [K], held at the ends."""
    size = xp.maximum(xp.abs(difference), SMALL)
    root = difference / size * xp.sqrt(xp.sqrt(size / WIDEST))
    return _within(xp, _HALF * (1.0 + root), 2.0 * _HALF)


def temperature_place(xp: Any, temperature: Array) -> Array:
    """Place in TEMPERATURES of a temperature [degC], held at the ends."""
    step = TEMPERATURES[1] - TEMPERATURES[0]
    return _within(xp, (temperature - TEMPERATURES[0]) / step, len(TEMPERATURES) - 1.0)


def _within(xp: Any, value: Array, most: float) -> Array:
    """value held at 0 and `most`: numpy's clip, which is a Python function, takes eight times as long."""
    return xp.minimum(xp.maximum(value, 0.0), most)


def read_table(xp: Any, table: Array, place: Array) -> Array:
    """Linear interpolation: table (..., k, m) at places (..., k) -> (..., k)."""
    m = table.shape[-1]
    left = _within(xp, xp.floor(place), m - 2.0).astype(int)
    # of all tables one after the other: take_along_axis makes the same index in Python, five times as slowly
    flat, at = xp.ravel(table), m * np.arange(left.size).reshape(left.shape) + left
    a, b = flat[at], flat[at + 1]
    return a + (place - left) * (b - a)


@dataclass(frozen=True)
class FilmPlan:
    """What the films of a load model need besides their tables; f films."""

    environment: Array  # (f,) index
    radiant: Array  # (f,) index
    emissivity: Array  # (f,)
    gradient: Array  # (f,) K/m of the air
    height: Array  # (f,) m where the air's temperature is measured
    mean_height: Array  # (f,) m of the films' surfaces, axes at zero
    climb: Array  # (a, f) by how much that grows per metre of each axis; a = 0 where no axis raises a film's surface

    def air(self, environment: Array, position: Array) -> Array:
        """degC (..., f) of the air at the mean height of the films' surfaces, which their laws see.

        environment (..., e) [degC], position (..., axes) [m].
        """
        height = self.mean_height + position @ self.climb if len(self.climb) else self.mean_height
        return environment[..., self.environment] + self.gradient * (height - self.height)

    @classmethod
    def of(cls, load: LoadModel, moment: Array, area: Array) -> FilmPlan:
        """moment (1 + a, f) m^3: of height, axes at zero, then [m^2] by the metre of each axis; area (f,) m^2."""
        air = [load.environments[f.environment] for f in load.films]
        return cls(
            environment=np.array([f.environment for f in load.films], dtype=np.int64),
            radiant=np.array([f.radiant for f in load.films], dtype=np.int64),
            emissivity=np.array([f.emissivity for f in load.films]),
            gradient=np.array([e.gradient for e in air]),
            height=np.array([e.height for e in air]),
            mean_height=moment[0] / area,
            climb=moment[1:] / area,
        )


@dataclass(frozen=True)
class FilmState:
    """Films of a step; f films, with a leading axis m where there are as many environments."""

    convection: Array  # (f,) W/(m^2 K)
    total: Array  # (..., f) W/(m^2 K), convection and radiation: what multiplies the affine term
    outer: Array  # (..., f) degC: the temperature outside that both together see, at height zero
    lift: Array  # (1 + a, f) W/m^3: convection times gradient, multiplies H; times positions, multiplies `raised`
    radiated: Array  # (..., f) W/m^2 into the surfaces by radiation


def film_state(
    xp: Any,
    plan: FilmPlan,
    convection: Array,
    surface: Array,
    environment: Array,
    position: Array,
    radiation: Array | float,
) -> FilmState:
    """Coefficients of films with convection (f,) [W/(m^2 K)] at mean surface temperatures (f,) [degC].

    environment (..., n_environments) [degC]; position (axes,) [m]; radiation: 1, or 0 to switch it off. With
    h_c (T - T_air) + h_r (T - T_rad) = (h_c + h_r)(T - T_outer), a surface needs one affine term for both.
    """
    air, radiant = environment[..., plan.environment], environment[..., plan.radiant]
    radiated = radiation * radiation_coefficient(surface, radiant, plan.emissivity)
    at_zero = air - plan.gradient * plan.height
    total = convection + radiated
    share = radiated / xp.where(total > 0.0, total, 1.0)
    outer = at_zero + share * (radiant - at_zero)
    lift = (convection * plan.gradient)[None]
    if len(plan.climb):
        lift = xp.concatenate([lift, position[:, None] * lift])
    return FilmState(convection, total, outer, lift, radiated * (radiant - surface))
