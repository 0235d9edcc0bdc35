"""Reduction order on the steel profile, beside it a model that is fitted and stable by its form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.stable_fit import fitted
from benchmarks.steel_profile import METHODS, table, training, transfer
from twin.build.compress import Tolerances, galerkin
from twin.rom.model import MachineModel

OMEGA = np.r_[0.0, np.logspace(-6, 2, 25)]  # rad/s, that are fitted at
ITERATIONS = 1000  # of either objective: some minutes on one core


def fit(rich: MachineModel, snapshots: list[np.ndarray], states: int, unit: Tolerances) -> MachineModel:
    """From the Galerkin model; the transfer functions of the rich one at the training films are what is fitted."""
    start, films = galerkin(rich, snapshots, states, unit).bodies[0], training(rich)
    exact = [transfer(rich.bodies[0], theta, OMEGA) for theta in films]
    return replace(rich, bodies=(fitted(start, films, OMEGA, exact, ITERATIONS),))


def main() -> None:
    table(METHODS | {"free": fit}, (40, 56))
