"""The real machine behind a shipped description, small enough for hundreds of trials.

It is assembled with a source at every surface, projected on its rich basis, then on the proper orthogonal modes of
trajectories in its very runs, which see every place, lost contacts and parameters far off. Parameters are affine, so
that one model serves all draws of them; TCP rows are those of the structure at the positions where it is measured.
`python -m benchmarks.shipped_machines NAME certify` compares it with the full model.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.build.acting import Acting, with_acting
from twin.build.cache import arrays_hash, cached, machine_hash
from twin.build.compress import Tolerances, galerkin
from twin.build.full_model import assemble
from twin.build.place_training import Shared, snapshots
from twin.build.places import Place, places_of, pruned, with_places
from twin.build.project import project
from twin.build.rich_basis import RichOptions, rich_basis
from twin.build.scenario import theta_bounds
from twin.logs.run import Run, Table, Tcp
from twin.logs.signals import signal_values
from twin.machine.description import Machine
from twin.machine.parameters import parameters
from twin.rom.apply import with_values
from twin.rom.drive import Drive, evaluate, measured_air
from twin.rom.model import MachineModel
from twin.rom.parameter import Parameter
from twin.rom.tcp import at_positions, by_body, tcp_at
from twin.run.replay import integrate
from twin.run.stepping import inputs_of
from twin.run.system import prepare

RICH = RichOptions(samples=10, tolerance=1e-2)
STEP, TRAINING_STEP = 60.0, 120.0  # s
DRAWS = 6  # of parameters and of what acts, that it is trained on
STATES = 400
UNIT = Tolerances(0.05, 1e-6)  # K, m


@dataclass(frozen=True)
class Reduced:
    """The real machine in its runs, with a source at every place."""

    model: MachineModel
    places: tuple[Place, ...]
    parameters: tuple[Parameter, ...]  # of the description, and the expansion of every part

    def measured(
        self, runs: Sequence[Run], values: Mapping[str, float], heat: Mapping[str, float], every: float
    ) -> list[Run]:
        """What it shows in runs without noise, every minute, and the TCP every so many seconds.

        values: of parameters [SI], by path. heat: W at places, always. Raises KeyError for unknown ones.
        """
        bare = pruned(self.model, list(heat))
        model = with_values(bare, self.parameters, values)
        prepared, found = prepare(model), []
        for run in runs:
            drive = _drive(with_values(pruned(self.model), self.parameters, values), run, STEP)
            power = {place: np.full(drive.n_steps, watts) for place, watts in heat.items()}
            start = prepared.uniform(_start(run))
            steps = integrate(
                prepared, inputs_of(model.load_model, with_acting(drive, model.load_model, Acting(power)), 1), start
            )
            states = prepared.to_artefact(np.concatenate([start[None], steps.z]))
            found.append(_shown(model, run, drive, by_body(model, states), round(every / STEP)))
        return found


def reduced(machine: Machine, runs: Sequence[Run], every: float) -> Reduced:
    """The reduced real machine, cached; some minutes where it is not there."""
    logged = [v for r in runs for v in (r.loads.time, *r.loads.columns.values())]
    key = (machine_hash(machine), arrays_hash(logged), RICH, DRAWS, STATES, UNIT, every)
    return Reduced(*cached("shipped", __name__, key, lambda: _made(machine, runs, every)))


def _made(
    machine: Machine, runs: Sequence[Run], every: float
) -> tuple[MachineModel, tuple[Place, ...], tuple[Parameter, ...]]:
    full = assemble(machine)
    places, known = places_of(machine, full), tuple(parameters(machine))
    growth = tuple(
        Parameter(f"parts.{p}.expansion", "expansion", (p,), 1.0, "1", 0.1, 10.0, 1.0) for p in machine.parts
    )
    model = with_places(full, places)
    low, high = theta_bounds(model.load_model)
    bodies = []
    for body in model.bodies:
        small = project(replace(body, F=None), rich_basis(body, low, high, RICH))
        bodies.append(replace(small, E=np.eye(small.n)))
    rich = replace(model, bodies=tuple(bodies))
    bare = pruned(rich)
    axes = [a.name for a in rich.load_model.axes]
    order = [axes.index(a) for a in rich.pose_axes]
    positions = [_drive(bare, r, STEP).position[_rows(r, every)][:, order] for r in runs]
    rich = at_positions(rich, np.vstack(positions))
    drives = tuple(_drive(bare, run, TRAINING_STEP) for run in runs)
    shared = Shared(rich, pruned(rich), known, places, drives, tuple(_start(r) for r in runs))
    described, drawn, heated = snapshots(shared, DRAWS)
    stacked = np.column_stack([*described, *drawn, *heated])
    parts = np.split(stacked, np.cumsum([b.n for b in bodies])[:-1])
    return galerkin(rich, parts, STATES, UNIT), places, (*known, *growth)


def _rows(run: Run, every: float) -> np.ndarray:
    """Steps at whose ends the TCP is measured."""
    n, each = int((run.loads.time[-1] - run.loads.time[0]) / STEP), round(every / STEP)
    return np.arange(each - 1, n, each)


def _drive(model: MachineModel, run: Run, dt: float) -> Drive:
    return evaluate(model.load_model, run.loads.time, signal_values(run, model.load_model.signals), dt)


def _start(run: Run) -> float:
    """degC. Drawn loads say it."""
    if run.initial_temperature is None:
        raise ValueError(f"{run.folder} does not say how warm the machine is at its start")
    return run.initial_temperature


def _shown(model: MachineModel, run: Run, drive: Drive, states: Sequence[np.ndarray], each: int) -> Run:
    """A run with what sensors and the TCP show of states (n + 1, n_b)."""
    T = np.full((len(drive.time), len(model.sensors)), model.reference_temperature)
    for body, own in zip(model.bodies, states, strict=True):
        T[:, list(body.sensors)] += own @ body.C.T
    columns = dict(zip(model.sensors, T.T, strict=True))
    air = measured_air(model.load_model, drive)
    columns |= {name: np.concatenate([air[:1, e], air[:, e]]) for name, e in model.ambient_sensors}
    at = np.arange(each - 1, drive.n_steps, each)
    axes = [a.name for a in model.load_model.axes]
    where = drive.position[at][:, [axes.index(a) for a in model.pose_axes]]
    w = tcp_at(model, [own[at + 1] for own in states], where)
    return replace(
        run,
        temperatures=Table(drive.time, columns, dict.fromkeys(columns, "degC")),
        tcp=Tcp(drive.time[at + 1], model.pose_axes, where, w, None),
        synthetic=("loads", "temperatures", "tcp"),
    )
