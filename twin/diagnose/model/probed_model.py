"""The probed model of a diagnosis: small, of one machine in its runs, with a source and a film at every location.

Made once per machine and loads, and cached: rich model with places -> trajectories on these loads -> window model.
Measurements come later, so that hundreds of synthetic ones may share it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from twin.build.cache import arrays_hash, cached, machine_hash
from twin.build.place_training import Shared, nominal, snapshots
from twin.build.places import DISPLACED, Place, pruned
from twin.calibrate.fit.measured import tcp_positions
from twin.calibrate.fit.problem import run_names
from twin.calibrate.fit.window import merged, window_basis
from twin.diagnose.model.beginning import Beginning, beginning_of
from twin.diagnose.model.gaps import unlogged
from twin.diagnose.model.ports_first import PortsFirst
from twin.diagnose.model.probed_loads import ProbedLoads, loads_for
from twin.diagnose.model.rich_probed_model import Mesh, RichProbedModel, rich_probed_model
from twin.errors import LogError
from twin.logs.run import Run
from twin.logs.signals import signal_values
from twin.machine.bodies import joined
from twin.machine.description import Machine
from twin.progress import Progress, silent
from twin.rom.contact_matrix import ContactPlaces
from twin.rom.drive import Drive, evaluate
from twin.rom.load_model import LoadModel
from twin.rom.model import MachineModel
from twin.rom.parameter import Parameter
from twin.rom.sampling import Intervals, cut
from twin.rom.tcp import at_positions
from twin.run.system import Layout, System, prepare

STEP = 60.0  # s
TRAINING_STEP = 120.0  # s
TAIL = 6e-7  # share of the squared trajectories, in units of the noise, that is left out
OF_NOMINAL = 1e-8  # the same of a window that knows nominal values alone
LARGEST = 220  # states
MEAN_OF = {"A": 2.0, "W": 1.0, "m/s": 1.0, "1/s": 1.0, "1": 1.0}  # by unit: e of |s|^e, which acts; else s
LEAST = 3600.0  # s, of a log


@dataclass(frozen=True)
class ProbedRun:
    """A run without its measurements."""

    name: str
    drive: Drive  # of the description
    signals: dict[str, np.ndarray]  # (n_steps,) means over the drive's steps, currents as rms, SI
    begins: Beginning
    unlogged: tuple[tuple[int, int], ...]  # first step and end of stretches without loads
    loads: ProbedLoads

    @property
    def step(self) -> float:
        """Of its drive [s]."""
        return float(self.drive.time[1] - self.drive.time[0])


@dataclass(frozen=True)
class ProbedModel:
    """P places, r states in coordinates with E = 1."""

    base: MachineModel  # the window model of the description
    layout: Layout
    system: System
    contacts: ContactPlaces
    parameters: tuple[Parameter, ...]
    places: tuple[Place, ...]
    B: np.ndarray  # (P, r) 1 W at each place
    A: np.ndarray  # (P, r, r) m^2: its film
    M: np.ndarray  # (P, r) m^2
    H: np.ndarray  # (r, n_films) m^3: what a gradient of the air does through each film
    displaced: np.ndarray  # (n_sensors, r): sensors moved aside; the sensors themselves on lumped machines
    runs: tuple[ProbedRun, ...]
    reduction: tuple[float, float]  # K, m: rms of what the window leaves of held-out trajectories at the worst output
    joined: frozenset[frozenset[str]] = frozenset()  # parts, or nodes and bars, that a contact joins, by two

    @cached_property
    def ports_first(self) -> PortsFirst:
        """The system as it is stepped."""
        return PortsFirst.of(self.system)


def drive_of(model: MachineModel, run: Run, dt: float = STEP) -> Drive:
    """A drive of the whole log: its last row is held to the end of its step.

    Raises LogError for a log shorter than an hour.
    """
    load = model.load_model
    span = float(run.loads.time[-1] - run.loads.time[0])
    if span < LEAST:
        raise LogError(f"the log covers {span / 60:.0f} min", str(run.folder), "a diagnosis needs an hour at least")
    return evaluate(load, run.loads.time, signal_values(run, load.signals), dt, int(np.ceil(span / dt - 1e-9)))


def drive_arrays(drive: Drive) -> tuple[np.ndarray, ...]:
    """All that a drive does to a machine."""
    return (
        drive.time, drive.power, drive.theta, drive.environment, drive.films.value, drive.losses.value,
        drive.contact_heat, drive.weight, drive.square, drive.conductance,
    )  # fmt: skip


def make_probed_model(
    machine: Machine, parameters: Sequence[Parameter], runs: Sequence[Run], progress: Progress = silent,
    mesh: Mesh = Mesh.DESCRIBED, nominal_of: Sequence[int] = (), step: float = STEP,
) -> ProbedModel:  # fmt: skip
    """The probed model of a machine and the loads of runs, cached by both; mesh: of which elements it is; step [s].

    nominal_of: the runs, by number, that it knows at nominal values, and nothing else; it has no places. Without
    them it knows all runs, and other values.
    """
    rich = rich_probed_model(machine, progress, mesh, probed=not nominal_of)
    rich = replace(rich, rich=at_positions(rich.rich, tcp_positions(rich.rich, runs)))
    base = pruned(rich.rich)
    load = base.load_model
    names = run_names(runs)
    drives = [drive_of(base, run, step) for run in runs]
    begins = [beginning_of(base, run, drive) for run, drive in zip(runs, drives, strict=True)]
    starts = tuple(own.temperature for own in begins)
    fields = tuple(own.of(base) for own in begins)
    known = tuple((p.path, p.nominal, p.sigma, p.low, p.high) for p in parameters)

    def make() -> tuple[np.ndarray, tuple[float, float]]:
        coarse = tuple(drive_of(base, run, TRAINING_STEP) for run in runs)
        shared = Shared(rich.rich, base, tuple(parameters), rich.places, coarse, starts, fields=fields)
        if nominal_of:
            drives, begin = tuple(coarse[k] for k in nominal_of), tuple(starts[k] for k in nominal_of)
            apart = tuple(fields[k] for k in nominal_of)
            train = held = nominal(replace(shared, drives=drives, starts=begin, fields=apart))
        else:
            described, drawn, heated = snapshots(shared, progress=progress)
            held = drawn[-len(runs) :]
            train = [*described, *drawn[: -len(runs)], *heated]
        rows = _rows(rich.rich)
        tail = OF_NOMINAL if nominal_of else TAIL
        V = window_basis(rich.rich, train, np.zeros((rich.rich.n, 0)), 0.05, rows, tail, LARGEST)
        X = np.column_stack(held)
        left = rows @ (X - V @ (V.T @ X))
        n = len(rich.rich.sensors)
        rms = np.sqrt(np.mean(left**2, axis=1))
        return V, (float(rms[:n].max(initial=0.0)) * 0.05, float(rms[n:].max(initial=0.0)) * 1e-6)

    if machine.lumped:
        V, reduction = np.eye(rich.rich.n), (0.0, 0.0)
    else:
        logged = (*_logged(load, runs), rich.rich.poses)
        inputs = (machine_hash(machine), mesh.name, tuple(nominal_of), known, starts, arrays_hash((*logged, *fields)))
        V, reduction = cached("window", __name__, inputs, make)
    return replace(_assembled(rich, V, parameters, runs, names, drives, begins, reduction), joined=joined(machine))


def _logged(load: LoadModel, runs: Sequence[Run]) -> Iterator[np.ndarray]:
    """All of the runs' logs that drives are made from."""
    for run in runs:
        yield run.loads.time
        columns = signal_values(run, load.signals)
        yield from (np.asarray(columns[name]) for name in sorted(columns))


def _rows(model: MachineModel) -> np.ndarray:
    """Sensors (0.05 K) and the TCP at every pose, or position that was measured at (1 um), as rows over all states."""
    C, first = np.zeros((len(model.sensors), model.n)), 0
    for body in model.bodies:
        C[list(body.sensors), first : first + body.n] = body.C
        first += body.n
    G = np.concatenate([b.G.reshape(-1, b.n) for b in model.bodies], axis=1)
    return np.vstack([C / 0.05, G / 1e-6])


def _assembled(
    rich: RichProbedModel, V: np.ndarray, parameters: Sequence[Parameter], runs: Sequence[Run], names: Sequence[str],
    drives: Sequence[Drive], begins: Sequence[Beginning], reduction: tuple[float, float],
) -> ProbedModel:  # fmt: skip
    whole = merged(rich.rich, V)
    (body,) = whole.bodies
    body = replace(body, E=np.eye(body.n))
    n_places = len(rich.places)
    load = whole.load_model
    n_films, n_sources = len(load.films) - n_places, len(load.sources) - n_places
    real = [k for k, s in enumerate(whole.sensors) if not s.endswith(DISPLACED)]
    aside = [whole.sensors.index(whole.sensors[k] + DISPLACED) if whole.sensors[k] + DISPLACED in whole.sensors else k
             for k in real]  # fmt: skip
    parts = np.split(V, np.cumsum([b.n for b in rich.rich.bodies])[:-1])
    H = np.sum([Vb.T @ h for Vb, h in zip(parts, rich.height, strict=True)], axis=0)
    base = pruned(replace(whole, bodies=(replace(body, C=body.C[real], sensors=tuple(range(len(real)))),)))
    base = replace(base, sensors=tuple(whole.sensors[k] for k in real))
    prepared = prepare(base)
    made = [
        ProbedRun(name, drive, _means(base, run, drive), own, unlogged(run, drive), loads_for(base, drive))
        for run, name, drive, own in zip(runs, names, drives, begins, strict=True)
    ]  # fmt: skip
    return ProbedModel(
        base, prepared.layout, prepared.system, ContactPlaces.of(load), tuple(parameters), rich.places,
        B=body.B[:, n_sources:].T.copy(),
        A=np.reshape(body.A[n_films : n_films + n_places], (n_places, body.n, body.n)),
        M=body.M[:, n_films : n_films + n_places].T.copy(), H=H, displaced=body.C[aside], runs=tuple(made),
        reduction=reduction,
    )  # fmt: skip


def _means(model: MachineModel, run: Run, drive: Drive) -> dict[str, np.ndarray]:
    """Means of signals over the drive's steps, as MEAN_OF says; what histories of hypotheses are made from.

    No single row tells of a cycle within a step. Where all rows are a step apart or more there is none to tell of: then
    it is the row that holds in the middle.
    """
    signals = model.load_model.signals
    time, edges = run.loads.time - drive.time[0], drive.time - drive.time[0]
    intervals = cut(time, edges) if np.any(np.diff(time) < (1.0 - 1e-6) * edges[1]) else None
    at = (drive.time[:-1] + drive.time[1:]) / 2 if intervals is None else run.loads.time
    exponent = {s.name: MEAN_OF.get(s.unit) for s in signals}
    result = {}
    for name, column in signal_values(run, signals).items():
        good = np.isfinite(column)
        if good.any():
            told = run.loads.time[good]
            last = np.clip(np.searchsorted(told, at, side="right") - 1, 0, len(told) - 1)
            held = np.asarray(column)[good][last]
            result[name] = held if intervals is None else _mean(intervals, held, exponent[name])
    return result


def _mean(intervals: Intervals, values: np.ndarray, exponent: float | None) -> np.ndarray:
    """(n_steps,) of held samples: their mean, or of their sizes the power mean with an exponent, signed as the mean."""
    mean = intervals.mean(values)
    if exponent is None:
        return mean
    size = np.maximum(intervals.mean(np.abs(values) ** exponent), 0.0) ** (1.0 / exponent)
    return np.copysign(size, mean)
