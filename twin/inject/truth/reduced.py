"""The other machine of hundreds of trials: its rich model, reduced on the runs of the experiment.

One other machine (`other_text(experiment, STRUCTURE)`) is assembled with a source and a film at every named surface,
projected on its rich basis, then on the proper orthogonal modes of trajectories in the three runs. Parameters are
affine, so this one model serves every draw of them, and a hidden source needs only its own input vector. The TCP rows
are those of the structure at the very positions where the plan measures: nothing is interpolated.
`python -m benchmarks hidden_certify` compares it with the full model of the same mesh.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from twin.build.cache import cached
from twin.build.compress import Tolerances, galerkin
from twin.build.full_model import FullModel, assemble
from twin.build.place_training import DRAWS, Draw, Shared, trajectory
from twin.build.places import PREFIX, Place, places_of, pruned, with_places
from twin.build.project import project
from twin.build.rich_basis import RichOptions, rich_basis
from twin.build.scenario import theta_bounds
from twin.build.workers import each
from twin.inject.experiment import RUNS, START, STEP, Experiment, plan
from twin.inject.truth.other_machine import OTHER_MESH, other_machine, other_text
from twin.logs.run import Run
from twin.logs.signals import signal_values
from twin.machine.parameters import parameters
from twin.rom.drive import Drive, evaluate
from twin.rom.model import AffineBody, MachineModel
from twin.rom.parameter import Parameter

STRUCTURE = 0  # seed of the one other machine
RICH = RichOptions(samples=12, tolerance=1e-2)
TRAINING_STEP = 120.0  # s
STATES = 500
UNIT = Tolerances(0.05, 1e-6)  # K, m


@dataclass(frozen=True)
class Reduced:
    """The other machine in its runs; reduced bodies with every place in them."""

    model: MachineModel  # `poses` are the plan's positions, one after the other; no grid
    places: tuple[Place, ...]
    heights: tuple[np.ndarray, ...]  # per body (n, n_films) m^3: what a gradient of the air does through each film
    parameters: tuple[Parameter, ...]
    tcp_time: tuple[np.ndarray, ...]  # per run (m,) s
    positions: tuple[np.ndarray, ...]  # per run (m, 3) m


@lru_cache(maxsize=2)
def reduced(experiment: Experiment) -> Reduced:
    """The reduced machine, from the cache folder; made in some minutes where it is not there, with gmsh."""
    loads = hashlib.sha256()
    for name in RUNS:
        loads.update((experiment.folder / "runs" / name / "loads.csv").read_bytes())
    known = (other_text(experiment, STRUCTURE), RICH, TRAINING_STEP, DRAWS, STATES, UNIT, OTHER_MESH)
    return cached("hidden", __name__, (*known, loads.hexdigest()), lambda: _made(experiment))


@lru_cache(maxsize=2)
def nominal_drives(experiment: Experiment) -> tuple[Drive, ...]:
    """What drives it in the runs as they were logged."""
    bare = pruned(reduced(experiment).model)
    return tuple(evaluated(bare, run, STEP) for run in experiment.runs)


def full_with_places(experiment: Experiment) -> tuple[FullModel, tuple[Place, ...]]:
    """The full model that `reduced` is made from, its thermal bodies with all places."""
    machine = other_machine(experiment, other_text(experiment, STRUCTURE))
    full = assemble(machine)
    places = places_of(machine, full)
    return replace(full, thermal=with_places(full, places)), places


def evaluated(model: MachineModel, run: Run, dt: float) -> Drive:
    """What drives a model in a run, in steps of `dt` [s]."""
    return evaluate(model.load_model, run.loads.time, signal_values(run, model.load_model.signals), dt)


def place_column(model: MachineModel, place: str) -> tuple[int, np.ndarray]:
    """The body that a place is on, and 1 W there (n,) among its states: also the row of its mean temperature."""
    k = [s.name for s in model.load_model.sources].index(PREFIX + place)
    for b, body in enumerate(model.bodies):
        if k in body.sources:
            return b, body.B[:, body.sources.index(k)]
    raise ValueError(f"no such place: {place}")


def _made(experiment: Experiment) -> Reduced:
    machine = other_machine(experiment, other_text(experiment, STRUCTURE))
    full = assemble(machine)
    places = places_of(machine, full)
    plans = [plan(run, full.thermal.pose_axes) for run in experiment.runs]
    positions = np.vstack([where for _, where in plans])
    rows = full.structure.pose_rows(positions)
    bodies = tuple(replace(b, G=G, F=None, W=None) for b, G in zip(full.thermal.bodies, rows, strict=True))
    full = replace(full, thermal=replace(full.thermal, bodies=bodies, poses=positions, structure=None))
    model = with_places(full, places)
    low, high = theta_bounds(model.load_model)
    n_films = len(full.thermal.load_model.films)
    rich, heights = [], []
    for b, body in enumerate(model.bodies):
        V = rich_basis(body, low, high, RICH)
        small = project(body, V)
        rich.append(replace(small, E=np.eye(small.n)))
        heights.append(V.T @ _height(body, full.bodies[b].nodes[:, 1], n_films))  # the machine's Y is up
    model = replace(model, bodies=tuple(rich))
    known = tuple(parameters(machine))
    base = pruned(model)
    drives = tuple(evaluated(base, run, TRAINING_STEP) for run in experiment.runs)
    shared = Shared(model, base, known, places, drives, (START,) * len(drives))
    draws = [Draw(run, seed) for seed in range(DRAWS + 1) for run in range(len(drives))]
    stacked = np.column_stack(each(trajectory, shared, draws))
    parts = np.split(stacked, np.cumsum([b.n for b in rich])[:-1])
    carried = tuple(_carrying(b, h) for b, h in zip(rich, heights, strict=True))
    compact = galerkin(replace(model, bodies=carried), parts, STATES, UNIT)
    stripped, projected = zip(*(_carried(b, n_films) for b in compact.bodies), strict=True)
    return Reduced(
        replace(compact, bodies=stripped), places, projected, known,
        tuple(when for when, _ in plans), tuple(where for _, where in plans),
    )  # fmt: skip


def _height(body: AffineBody, y: np.ndarray, n_films: int) -> np.ndarray:
    """A_k @ height (n, n_films) of the description's films."""
    H, z = np.zeros((body.n, n_films)), np.zeros(body.n)
    z[: len(y)] = y
    for term, k in zip(body.A, body.theta, strict=True):
        if k < n_films:
            H[:, k] = term @ z
    return H


def _carrying(body: AffineBody, height: np.ndarray) -> AffineBody:
    """The body with heights among its inputs, so that they are projected with it."""
    return replace(body, B=np.hstack([body.B, height]))


def _carried(body: AffineBody, n_films: int) -> tuple[AffineBody, np.ndarray]:
    return replace(body, B=body.B[:, :-n_films]), body.B[:, -n_films:]
