"""Truth for hundreds of hidden-effect trials: the other machine's rich model, reduced on the runs for diagnosis.

One other machine (`other_text(STRUCTURE)`: its own mesh, film laws, sensor places) is assembled with a source and a
film at every named surface, projected on its rich basis, then on the POD of trajectories in the three runs. Parameters
are affine, so this one model serves every draw of them, and a hidden source needs only its own input vector. The TCP
rows are those of the structure at the very positions where the plan measures: nothing is interpolated.

Every body has one slot for a film and the machine has two for sources: shapes never change, JAX compiles once.
`python -m benchmarks hidden_certify` compares it with the full model of the same mesh.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.five_axis import FOLDER
from benchmarks.hidden_truth import OTHER_MESH, START, STEP, SUBSTEPS, machine_of, other_text
from tests.hidden.load import RUNS, plan
from twin.atomic import atomic_path
from twin.build.acting import Acting, with_acting
from twin.build.cache import folder
from twin.build.compress import Tolerances, galerkin
from twin.build.full_model import FullModel, assemble
from twin.build.pipeline import theta_bounds
from twin.build.place_training import Shared, snapshots
from twin.build.places import PREFIX, Place, places_of, pruned, with_places
from twin.build.project import project
from twin.build.rich_basis import RichOptions, rich_basis
from twin.logs.read import read_run
from twin.logs.run import Run
from twin.logs.signals import signal_values
from twin.machine.parameters import parameters
from twin.progress import Progress, silent
from twin.rom.apply import with_values
from twin.rom.drive import Drive, evaluate
from twin.rom.model import AffineBody, MachineModel
from twin.rom.parameter import Parameter
from twin.rom.rescale import rescaled
from twin.run.replay import march
from twin.run.stepping import inputs_of
from twin.run.system import prepare

STRUCTURE = 0  # seed of the one other machine
RICH = RichOptions(samples=12, tolerance=1e-2)
TRAINING_STEP = 120.0  # s
STATES = 500
UNIT = Tolerances(0.05, 1e-6)  # K, m
SOURCES = 2  # places with a source


@dataclass(frozen=True)
class Fast:
    """The other machine in its runs; reduced bodies with every place in them."""

    model: MachineModel  # `poses` are the plan's positions, one after the other; no grid
    places: tuple[Place, ...]
    heights: tuple[np.ndarray, ...]  # per body (n, n_films) m^3: what a gradient of the air does through each film
    parameters: tuple[Parameter, ...]
    tcp_time: tuple[np.ndarray, ...]  # per run (m,) s
    positions: tuple[np.ndarray, ...]  # per run (m, 3) m


@dataclass(frozen=True)
class Clean:
    """What the machine did in one run, without noise."""

    time: np.ndarray  # (n + 1,) s
    temperatures: np.ndarray  # (n + 1, n_sensors) degC, of Fast.model.sensors
    tcp_time: np.ndarray  # (m,) s
    positions: np.ndarray  # (m, 3) m
    tcp: np.ndarray  # (m, 3) m
    shown: Mapping[str, np.ndarray]  # (n + 1,) degC: mean temperatures of Effects.heats
    moved: np.ndarray  # (n + 1, 3) m: TCP at the mean of the run's positions


@cache
def runs() -> tuple[Run, ...]:
    """The loads of the runs for diagnosis, as logged."""
    return tuple(read_run(FOLDER / "runs" / name) for name in RUNS)


def kept() -> Path:
    """Where the reduced machine is kept, by the text of the description, the loads and what it is reduced with."""
    known = (other_text(STRUCTURE), RICH, TRAINING_STEP, STATES, UNIT, OTHER_MESH)
    digest = hashlib.sha256(repr(known).encode())
    for name in RUNS:
        digest.update((FOLDER / "runs" / name / "loads.csv").read_bytes())
    return folder() / "hidden-truth" / f"fast-{digest.hexdigest()[:20]}.pickle"


@cache
def fast(progress: Progress = silent) -> Fast:
    """The reduced machine, from the cache folder; made in some minutes where it is not there."""
    path = kept()
    if path.exists():
        return pickle.loads(path.read_bytes())
    made = _made(other_text(STRUCTURE), progress)
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_path(path) as temporary, open(temporary, "wb") as f:
        pickle.dump(made, f, protocol=5)
    return made


def full_with_places() -> tuple[FullModel, tuple[Place, ...]]:
    """The full model that `fast` is made from, its thermal bodies with all places."""
    machine = machine_of(other_text(STRUCTURE))
    full = assemble(machine)
    places = places_of(machine, full)
    return replace(full, thermal=with_places(full, places)), places


def _made(text: str, progress: Progress) -> Fast:
    machine = machine_of(text)
    full = assemble(machine, progress)
    places = places_of(machine, full)
    plans = [plan(run, full.thermal.pose_axes) for run in runs()]
    positions = np.vstack([where for _, where in plans])
    rows = full.structure.pose_rows(positions)
    bodies = tuple(replace(b, G=G, F=None) for b, G in zip(full.thermal.bodies, rows, strict=True))
    full = replace(full, thermal=replace(full.thermal, bodies=bodies, poses=positions))
    model = with_places(full, places)
    low, high = theta_bounds(model.load_model)
    n_films = len(full.thermal.load_model.films)
    rich, heights = [], []
    with progress("rich basis", RICH.samples * len(model.bodies)) as advance:
        for b, body in enumerate(model.bodies):
            V = rich_basis(body, low, high, RICH, advance)
            small = project(body, V)
            rich.append(replace(small, E=np.eye(small.n)))
            heights.append(V.T @ _height(body, full.bodies[b].nodes[:, 1], n_films))  # the machine's Y is up
    model = replace(model, bodies=tuple(rich))
    known = tuple(parameters(machine))
    base = pruned(model)
    drives = tuple(_evaluated(base, run, TRAINING_STEP) for run in runs())
    stacked = np.column_stack(
        snapshots(Shared(model, base, known, places, drives, (START,) * len(drives)), progress=progress)
    )
    parts = np.split(stacked, np.cumsum([b.n for b in rich])[:-1])
    carried = tuple(_carrying(b, h) for b, h in zip(rich, heights, strict=True))
    reduced = galerkin(replace(model, bodies=carried), parts, STATES, UNIT)
    stripped, projected = zip(*(_carried(b, n_films) for b in reduced.bodies), strict=True)
    return Fast(
        replace(reduced, bodies=stripped), places, projected, known,
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


def _evaluated(model: MachineModel, run: Run, dt: float) -> Drive:
    return evaluate(model.load_model, run.loads.time, signal_values(run, model.load_model.signals), dt)


@dataclass(frozen=True)
class Effects:
    """What a trial's machine has besides its parameters; run: the index in RUNS."""

    heats: tuple[str, ...] = ()  # places with a source in `acting`, or whose mean temperature is wanted
    films: tuple[str, ...] = ()  # places with a film in `acting`
    acting: Callable[[int, Drive], Acting] = lambda _run, _drive: Acting()  # the drive as the machine feels it
    loads: Callable[[int, Drive], Drive] = lambda _run, drive: drive  # of the description: what really drives
    shape: Callable[[MachineModel], MachineModel] = lambda model: model  # the reduced machine made another
    really: Callable[[int, Run], Run] = lambda _run, log: log  # the loads that the machine had where the log is wrong
    laws: bool = False  # whether `shape` changes laws, or `really` loads: the logs must be evaluated anew
    warm: Mapping[tuple[int, str], float] = field(default_factory=dict)  # (run, body) -> K warmer at the start
    late: Mapping[int, float] = field(default_factory=dict)  # run -> s that its measurements are behind their times


def fast_truth(fast: Fast, values: Mapping[str, float], effects: Effects = Effects()) -> tuple[Clean, ...]:
    """What the machine with parameters at `values` [SI], by path, does in the three runs.

    Raises ValueError where more than two places heat, or two of one body have films.
    """
    nominal = effects.shape(_slotted(fast, effects))
    there = with_values(nominal, fast.parameters, values)
    made = _nominal_drives()
    if effects.laws:
        made = [_evaluated(pruned(nominal), effects.really(r, log), STEP) for r, log in enumerate(runs())]
    prepared = prepare(there)
    bare, wanted = pruned(nominal).load_model, pruned(there).load_model
    C, T_ref = np.asarray(prepared.system.C), there.reference_temperature
    rows = np.split(np.asarray(prepared.system.G).reshape(-1, 3, there.n), np.cumsum([len(t) for t in fast.tcp_time]))
    means = {name: _mean_row(there, prepared.back, name) for name in effects.heats}
    result = []
    for r in range(len(RUNS)):
        own = effects.loads(r, rescaled(made[r], bare, wanted))
        drive = with_acting(own, there.load_model, effects.acting(r, own))
        warmer = {body: by for (run, body), by in effects.warm.items() if run == r}
        start = prepared.uniform(START) + _warmer(there, prepared.back, warmer)
        z = np.concatenate([start[None], march(prepared, inputs_of(there.load_model, drive, SUBSTEPS), start).z])
        # a row is taken at the end of the step that it falls in, as the full model's
        at = np.clip(np.searchsorted(drive.time, fast.tcp_time[r] - effects.late.get(r, 0.0)), 0, drive.n_steps)
        tcp = np.einsum("mcn,mn->mc", rows[r], z[at])
        shown = {name: T_ref + z @ row for name, row in means.items()}
        moved = z @ rows[r].mean(axis=0).T
        result.append(Clean(drive.time, T_ref + z @ C.T, fast.tcp_time[r], fast.positions[r], tcp, shown, moved))
    return tuple(result)


def _slotted(fast: Fast, effects: Effects) -> MachineModel:
    """Two places with sources, one of every body with a film: those that act, filled up with others."""
    names = [p.name for p in fast.places]
    sources = list(dict.fromkeys(effects.heats))
    if len(sources) > SOURCES:
        raise ValueError(f"more than {SOURCES} places heat or are read: {', '.join(sources)}")
    sources += [name for name in names if name not in sources][: SOURCES - len(sources)]
    slots = []
    for b in range(len(fast.model.bodies)):
        # pads come last among the places: their films would change the order
        own = [n for n in names if place_column(fast.model, n)[0] == b and not n.startswith("contacts.")]
        wanted = [n for n in dict.fromkeys(effects.films) if n in own]
        if len(wanted) > 1:
            raise ValueError(f"two films on one body: {', '.join(wanted)}")
        slots += wanted or own[:1]
    if lacking := [n for n in effects.films if n not in slots]:
        raise ValueError(f"no slot for a film at {', '.join(lacking)}")
    return pruned(fast.model, sources, slots)


@cache
def _nominal_drives() -> list[Drive]:
    bare = pruned(fast().model)
    return [_evaluated(bare, run, STEP) for run in runs()]


def place_column(model: MachineModel, place: str) -> tuple[int, np.ndarray]:
    """The body that a place is on, and 1 W there (n,) among its states: also the row of its mean temperature."""
    k = [s.name for s in model.load_model.sources].index(PREFIX + place)
    for b, body in enumerate(model.bodies):
        if k in body.sources:
            return b, body.B[:, body.sources.index(k)]
    raise ValueError(f"no such place: {place}")


def _mean_row(model: MachineModel, back: Sequence[np.ndarray], place: str) -> np.ndarray:
    """(N,) over the states of `prepare`: mean temperature of a place."""
    where, column = place_column(model, place)
    return np.concatenate([X.T @ column if b == where else np.zeros(len(X)) for b, X in enumerate(back)])


def _warmer(model: MachineModel, back: Sequence[np.ndarray], by: Mapping[str, float]) -> np.ndarray:
    """(N,) over the states of `prepare`: bodies warmer by some kelvins."""
    parts = zip(model.bodies, back, strict=True)
    return np.concatenate([by.get(body.name, 0.0) * np.linalg.solve(X, body.one) for body, X in parts])
