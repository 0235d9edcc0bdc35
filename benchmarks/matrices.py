"""Matrices alone: `twin import` of the parametric steel profile, its error by states, and how long it takes."""

from __future__ import annotations

import tempfile
import time
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Literal

import numpy as np
import scipy.io

from benchmarks.steel_profile import HELD_OUT, OMEGA, largest, transfer
from benchmarks.steel_profile_model import profile
from twin.build.frequency_training import drawn_films
from twin.build.matrices.files import Matrices, read_matrices
from twin.build.matrices.model import MatrixOptions, as_given, model_of, outputs
from twin.build.pipeline import BuildOptions
from twin.build.rich_basis import RichOptions
from twin.build.scenario import draw, theta_bounds
from twin.build.stepper import CoupledStepper
from twin.face.import_matrices import FILMS, import_matrices
from twin.rom.artefact import read_artefact
from twin.rom.model import AffineBody, MachineModel

METHODS: tuple[Literal["galerkin", "balanced"], ...] = ("galerkin", "balanced")
STATES = (40, 56)
UNSEEN = (301, 302)  # seeds of scenarios, 8 h at 30 s, surroundings apart
# A tight basis, to the decay of the finest element and well beyond, as of the benchmark steel_profile.
TIGHT = RichOptions(samples=24, shift_high=100.0, tolerance=3e-5)


def write(folder: Path, refinements: int) -> list[Path]:
    """Matrices of the profile as Matrix Market files."""
    machine = profile(refinements)
    body = machine.bodies[0]
    files = {"K": body.A0, "C": body.E, "Y": body.C}
    files |= {
        f"A{i}_{film.name}": a for i, (a, film) in enumerate(zip(body.A, machine.load_model.films, strict=True), 1)
    }
    for name, matrix in files.items():
        scipy.io.mmwrite(folder / f"{name}.mtx", matrix, precision=16)
    return [folder / f"{name}.mtx" for name in files]


def with_outputs(model: MachineModel, matrices: Matrices, options: MatrixOptions) -> AffineBody:
    """The body with the outputs that were given, in place of the two sides of each difference."""
    body = model.bodies[0]
    return replace(body, C=as_given(outputs(matrices, options), body.C))


def stepped(model: MachineModel, body: AffineBody, seed: int) -> np.ndarray:
    """(steps, outputs): differences of temperatures in a scenario [K]."""
    stepper = CoupledStepper(model)
    scenario = draw(model.load_model, seed, 8.0, 30.0, air_apart=True)
    return np.array([body.C @ x[0] for _, x, _ in stepper.run(scenario.drive, stepper.uniform(scenario.start))])


def main() -> None:
    for refinements in (2, 3):
        with tempfile.TemporaryDirectory() as scratch:
            files = write(Path(scratch), refinements)
            matrices, matrix = read_matrices(files), MatrixOptions()
            full = model_of("profile", matrices, matrix)
            exact_body = with_outputs(full, matrices, matrix)
            films = drawn_films(*theta_bounds(full.load_model), HELD_OUT, 101)
            exact = [transfer(exact_body, theta, OMEGA) for theta in films]
            truth = [stepped(full, exact_body, seed) for seed in UNSEEN]
            print(f"   {full.n} nodes, {len(exact_body.C)} outputs, all differences")
            for method, states in product(METHODS, STATES):
                target = Path(scratch) / "profile.h5"
                began = time.perf_counter()
                import_matrices(files, target, matrix, BuildOptions(method, states, TIGHT, FILMS), False)
                took = time.perf_counter() - began
                model = read_artefact(target).model
                body = with_outputs(model, matrices, matrix)
                over = max(
                    largest(transfer(body, t, OMEGA) - H) / largest(H) for t, H in zip(films, exact, strict=True)
                )
                runs = [stepped(model, body, seed) for seed in UNSEEN]
                off = max(np.abs(a - b).max() for a, b in zip(runs, truth, strict=True))
                size = max(np.abs(b).max() for b in truth)
                print(
                    f"   {method}, {states} states: {off / size:.1e} over two unseen scenarios, {over:.1e} over all "
                    f"frequencies and {HELD_OUT} sets of films; imported and certified in {took:.0f} s",
                    flush=True,
                )
