"""What drives one time step: film coefficients, radiation and losses, from the drive and the state at the step's start.

The one place where films and laws that follow a temperature are evaluated: by the full model, the runtime, the window
model of a calibration and the probed model of a diagnosis. Functions take numpy and JAX arrays alike (`xp` is numpy or
jax.numpy).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.rom.following import FilmPlan, FilmState, difference_place, film_state, read_table, temperature_place
from twin.rom.scatter import put

Array = Any


@dataclass(frozen=True)
class Tabulated:
    """Numbers (n,) that the log alone tells, but for those at `index` (k), which are read from tables (k, m)."""

    value: Array
    index: tuple[int, ...]
    table: Array

    @property
    def places(self) -> np.ndarray:
        return np.array(self.index, dtype=int)

    def read(self, xp: Any, place: Array) -> Array:
        """(n,) with the tables read at places (k,)."""
        return put(xp, self.value, self.places, read_table(xp, self.table, place)) if self.index else self.value


@dataclass(frozen=True)
class StepDrive:
    """One step of a drive."""

    convection: Tabulated  # (n_films,) W/(m^2 K), over DIFFERENCES
    joints: Array  # (n_joints,) W/(m^2 K)
    power: Tabulated  # (n_sources,) W, over TEMPERATURES
    port_heat: Array  # (n_ports,) W
    environment: Array  # (n_environments,) degC
    position: Array  # (axes,) m, mean over the step
    radiation: Array | float  # 1 or 0


@dataclass(frozen=True)
class StepLoads:
    """What drives a step, with the laws that follow the state read at its start."""

    theta: Array  # (n_theta,) W/(m^2 K), films with radiation, then joints
    rise: Array  # (n_films,) K: outer temperature above the reference
    lift: Array  # (1 + a, n_films) multiplies H, then `raised` of every axis
    power: Array  # (n_sources,) W
    port_heat: Array  # (n_ports,) W
    surface: Array  # (n_films,) degC, at the step's start
    winding: Array  # (k,) degC, likewise of the sources whose law follows it
    radiated: Array  # (n_films,) W/m^2 into the surfaces by radiation


def step_loads(
    xp: Any, plan: FilmPlan, drive: StepDrive, surface: Array, winding: Array, reference: Array | float
) -> StepLoads:
    """The loads of a step at mean temperatures [degC] of films' surfaces (n_films,) and of following sources (k,)."""
    films = film_loads(xp, plan, drive.convection, surface, drive.environment, drive.position, drive.radiation)
    return StepLoads(
        theta=xp.concatenate([films.total, drive.joints]),
        rise=films.outer - reference,
        lift=films.lift,
        power=source_powers(xp, drive.power, winding),
        port_heat=drive.port_heat,
        surface=surface,
        winding=winding,
        radiated=films.radiated,
    )


def film_loads(
    xp: Any,
    plan: FilmPlan,
    convection: Tabulated,
    surface: Array,
    environment: Array,
    position: Array,
    radiation: Array | float,
    factor: Array | float = 1.0,
) -> FilmState:
    """Films at surface temperatures (f,) [degC] in environments (e,), or in m one after the other (m, e) [degC].

    position (axes,) [m]: where the axes stand in the mean. Laws that follow the surface read the mean environment;
    factor (f,) scales the convection that they give.
    """
    own = convection.places
    air = plan.air(environment if environment.ndim == 1 else environment.mean(axis=0), position)
    h = convection.read(xp, difference_place(xp, surface[own] - air[own])) if len(own) else convection.value
    return film_state(xp, plan, h * factor, surface, environment, position, radiation)


def source_powers(xp: Any, power: Tabulated, winding: Array) -> Array:
    """Powers (n_sources,) [W] with the following sources at temperatures (k,) [degC]."""
    return power.read(xp, temperature_place(xp, winding))
