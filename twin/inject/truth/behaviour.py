"""What the reduced other machine does in the runs, with something hidden in it: the clean truth of a trial.

Every body has one slot for a film and the machine has two for sources: shapes never change, JAX compiles once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from twin.build.acting import Acting, with_acting
from twin.build.places import pruned
from twin.inject.experiment import RUNS, START, STEP, SUBSTEPS, Experiment
from twin.inject.truth.reduced import Reduced, evaluated, nominal_drives, place_column, reduced
from twin.logs.run import Run
from twin.rom.apply import with_values
from twin.rom.drive import Drive
from twin.rom.model import MachineModel
from twin.rom.rescale import rescaled
from twin.run.replay import integrate
from twin.run.stepping import inputs_of
from twin.run.system import prepare

SOURCES = 2  # places with a source


@dataclass(frozen=True)
class Behaviour:
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


@dataclass(frozen=True)
class Clean:
    """What the machine did in one run, without noise."""

    time: np.ndarray  # (n + 1,) s
    temperatures: np.ndarray  # (n + 1, n_sensors) degC, of Reduced.model.sensors
    tcp_time: np.ndarray  # (m,) s
    positions: np.ndarray  # (m, 3) m
    tcp: np.ndarray  # (m, 3) m
    shown: Mapping[str, np.ndarray]  # (n + 1,) degC: mean temperatures of Behaviour.heats
    moved: np.ndarray  # (n + 1, 3) m: TCP at the mean of the run's positions


def clean_runs(
    experiment: Experiment, values: Mapping[str, float], behaviour: Behaviour = Behaviour()
) -> tuple[Clean, ...]:
    """What the machine with parameters at `values` [SI], by path, does in the three runs.

    Raises ValueError where more than two places heat, or two of one body have films.
    """
    known = reduced(experiment)
    nominal = behaviour.shape(_slotted(known, behaviour))
    there = with_values(nominal, known.parameters, values)
    made = nominal_drives(experiment)
    if behaviour.laws:
        made = tuple(
            evaluated(pruned(nominal), behaviour.really(r, log), STEP) for r, log in enumerate(experiment.runs)
        )
    prepared = prepare(there)
    bare, wanted = pruned(nominal).load_model, pruned(there).load_model
    C, T_ref = np.asarray(prepared.system.C), there.reference_temperature
    rows = np.split(np.asarray(prepared.system.G).reshape(-1, 3, there.n), np.cumsum([len(t) for t in known.tcp_time]))
    means = {name: _mean_row(there, prepared.back, name) for name in behaviour.heats}
    result = []
    for r in range(len(RUNS)):
        own = behaviour.loads(r, rescaled(made[r], bare, wanted))
        drive = with_acting(own, there.load_model, behaviour.acting(r, own))
        warmer = {body: by for (run, body), by in behaviour.warm.items() if run == r}
        start = prepared.uniform(START) + _warmer(there, prepared.back, warmer)
        z = np.concatenate([start[None], integrate(prepared, inputs_of(there.load_model, drive, SUBSTEPS), start).z])
        # a row is taken at the end of the step that it falls in, as the full model's
        at = np.clip(np.searchsorted(drive.time, known.tcp_time[r] - behaviour.late.get(r, 0.0)), 0, drive.n_steps)
        tcp = np.einsum("mcn,mn->mc", rows[r], z[at])
        shown = {name: T_ref + z @ row for name, row in means.items()}
        moved = z @ rows[r].mean(axis=0).T
        result.append(Clean(drive.time, T_ref + z @ C.T, known.tcp_time[r], known.positions[r], tcp, shown, moved))
    return tuple(result)


def _slotted(known: Reduced, behaviour: Behaviour) -> MachineModel:
    """Two places with sources, one of every body with a film: those that act, filled up with others."""
    names = [p.name for p in known.places]
    sources = list(dict.fromkeys(behaviour.heats))
    if len(sources) > SOURCES:
        raise ValueError(f"more than {SOURCES} places heat or are read: {', '.join(sources)}")
    sources += [name for name in names if name not in sources][: SOURCES - len(sources)]
    slots = []
    for b in range(len(known.model.bodies)):
        # pads come last among the places: their films would change the order
        own = [n for n in names if place_column(known.model, n)[0] == b and not n.startswith("contacts.")]
        wanted = [n for n in dict.fromkeys(behaviour.films) if n in own]
        if len(wanted) > 1:
            raise ValueError(f"two films on one body: {', '.join(wanted)}")
        slots += wanted or own[:1]
    if lacking := [n for n in behaviour.films if n not in slots]:
        raise ValueError(f"no slot for a film at {', '.join(lacking)}")
    return pruned(known.model, sources, slots)


def _mean_row(model: MachineModel, back: Sequence[np.ndarray], place: str) -> np.ndarray:
    """(N,) over the states of `prepare`: mean temperature of a place."""
    where, column = place_column(model, place)
    return np.concatenate([X.T @ column if b == where else np.zeros(len(X)) for b, X in enumerate(back)])


def _warmer(model: MachineModel, back: Sequence[np.ndarray], by: Mapping[str, float]) -> np.ndarray:
    """(N,) over the states of `prepare`: bodies warmer by some kelvins."""
    parts = zip(model.bodies, back, strict=True)
    return np.concatenate([by.get(body.name, 0.0) * np.linalg.solve(X, body.one) for body, X in parts])
