"""Runs and parameters as one least-squares problem on a window model: outputs and their Jacobian as functions of u."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
import numpy as np

from twin.calibrate.fit.effects import Effects, Start, effects_of
from twin.calibrate.fit.integration import Rows, WindowLoads, displacements, loads_for, temperatures, trajectory
from twin.calibrate.fit.measured import Measured, after_steps, measured, tcp_positions
from twin.calibrate.fit.options import Options
from twin.calibrate.fit.training import History, basis_for, trained
from twin.calibrate.fit.window import merged, require_galerkin
from twin.logs.run import Run
from twin.logs.signals import signal_values
from twin.progress import Progress, silent
from twin.rom.artefact import Artefact
from twin.rom.contact_matrix import ContactPlaces
from twin.rom.drive import Drive, evaluate, measured_air
from twin.rom.model import MachineModel
from twin.rom.parameter import Parameter
from twin.rom.rest import STEPS as REST_STEPS
from twin.rom.rest import with_rest
from twin.rom.tcp import at_positions
from twin.run.system import Layout, System, prepare


@dataclass(frozen=True)
class FitRun:
    """A run made ready."""

    name: str
    drive: Drive  # at nominal parameters
    start: float  # degC
    measured: Measured
    loads: WindowLoads
    rows: Rows
    z0: np.ndarray  # (r,)


@dataclass(frozen=True)
class Form:
    """What a compiled program is specialised on."""

    layout: Layout
    places: ContactPlaces
    from_first: bool  # displacements are those since the first measurement
    derivative: bool = False


@dataclass(frozen=True)
class Problem:
    """n parameters of the machine, i of initial states; outputs are per run temperatures (b, s), then TCP (k, 3)."""

    model: MachineModel  # the window model
    basis: np.ndarray  # (N, r): artefact states are basis @ z
    parameters: tuple[Parameter, ...]
    starts: tuple[Start, ...]
    runs: tuple[FitRun, ...]
    layout: Layout
    system: System
    places: ContactPlaces
    effects: Effects
    options: Options
    snapshots: tuple[np.ndarray, ...]  # (N, m) that the window model was made from

    @cached_property
    def scale(self) -> np.ndarray:
        """(n + i,) prior standard deviations in units of u."""
        return np.array([p.sigma for p in self.parameters] + [s.sigma for s in self.starts])

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(p.path for p in self.parameters) + tuple(s.path(self.runs[s.run].name) for s in self.starts)

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Low and high (n + i,) in prior standard deviations."""
        ends = [(p.coordinate(p.low), p.coordinate(p.high)) for p in self.parameters]
        ends += [(-s.bound / s.sigma, s.bound / s.sigma) for s in self.starts]
        low, high = np.array(ends).reshape(-1, 2).T
        return low, high

    def values(self, x: np.ndarray) -> dict[str, float]:
        """Values [SI] of the machine's parameters at x (n + i,) in prior standard deviations."""
        return {p.path: p.value(float(c)) for p, c in zip(self.parameters, x, strict=False)}

    def outputs(self, x: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Per run the means of sensors (b, s) [degC] and the TCP deviations (k, 3) [m]."""
        u = jnp.asarray(x * self.scale)
        return [self.split(run, np.asarray(self.call(_outputs, run, u))) for run in self.runs]

    def jacobian(self, x: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Per run their derivatives (b, s, n + i) and (k, 3, n + i) by x."""
        u = jnp.asarray(x * self.scale)
        return [self.split(run, np.asarray(self.call(_jacobian, run, u)) * self.scale) for run in self.runs]

    def states(self, run: FitRun, x: np.ndarray) -> np.ndarray:
        """z (n_steps + 1, r) of a run."""
        u = jnp.asarray(x * self.scale)
        return np.asarray(
            trajectory(self.layout, self.places, False, self.system, self._effects(run), run.loads, run.z0, u)
        )

    def _effects(self, run: FitRun) -> Effects:
        """With the initial fields of other runs switched off: one compiled function serves all."""
        k = next(i for i, other in enumerate(self.runs) if other is run)
        own = np.array([[float(s.run == k)] for s in self.starts]).reshape(-1, 1)
        return jax.tree_util.tree_unflatten(
            jax.tree_util.tree_structure(self.effects),
            [*jax.tree_util.tree_leaves(self.effects)[:-1], np.asarray(self.effects.initial) * own],
        )

    def call(self, function: Any, run: FitRun, u: jax.Array) -> jax.Array:
        m = run.measured
        return function(
            Form(self.layout, self.places, m.from_first), self.system, self._effects(run), run.loads, run.rows,
            (m.mean_of, m.column), run.z0, u,
        )  # fmt: skip

    def split(self, run: FitRun, flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        m = run.measured
        n = m.mean_of.shape[0] * len(m.sensors)
        rest = flat.shape[1:]
        sensors, tcp = (m.mean_of.shape[0], len(m.sensors), *rest), (len(m.tcp), 3, *rest)
        return flat[:n].reshape(sensors), flat[n:].reshape(tcp)


def outputs_of(
    form: Form, system: System, effects: Effects, loads: WindowLoads, rows: Rows,
    bins: tuple[jax.Array, jax.Array], z0: jax.Array, u: jax.Array,
) -> jax.Array:  # fmt: skip
    states = trajectory(form.layout, form.places, form.derivative, system, effects, loads, z0, u)
    mean_of, column = bins
    T = jnp.asarray(mean_of) @ temperatures(system, states)[:, column]
    w = displacements(effects, rows, states, u)
    if form.from_first:
        w = w - w[0]
    return jnp.concatenate([T.ravel(), w.ravel()])


_outputs = partial(jax.jit, static_argnums=0)(outputs_of)


@partial(jax.jit, static_argnums=0)
def _jacobian(form: Form, *arguments: Any) -> jax.Array:
    own = replace(form, derivative=True)
    return jax.jacfwd(partial(outputs_of, own), argnums=len(arguments) - 1)(*arguments)


def run_names(runs: Sequence[Run]) -> list[str]:
    """Short names of runs, each once."""
    names: list[str] = []
    for run in runs:
        base = run.folder.name or "run"
        name, k = base, 2
        while name in names:
            name, k = f"{base}-{k}", k + 1
        names.append(name)
    return names


def problem(
    artefact: Artefact,
    runs: Sequence[Run],
    parameters: Sequence[Parameter],
    options: Options = Options(),
    also: Sequence[dict[str, float]] = (),
    earlier: Sequence[np.ndarray] = (),
    progress: Progress = silent,
) -> Problem:
    """Make a window model for runs and parameters. also: values of parameters whose trajectories it shall hold, too.
    earlier: the snapshots of a problem with the same runs and parameters, which are then not computed again.

    Raises LogError for runs without loads or measurements that fit, TwinError for parameters the artefact lacks.
    """
    require_galerkin(artefact.model)
    model = at_positions(artefact.model, tcp_positions(artefact.model, runs))
    load = model.load_model
    ready = []
    for run, name in zip(runs, run_names(runs), strict=True):
        drive = evaluate(load, run.loads.time, signal_values(run, load.signals), options.dt)
        start = run.initial_temperature
        start = float(measured_air(load, drive)[0, load.surroundings]) if start is None else start
        m = measured(model, run, drive, name, options.bin_length, options.exclude)
        if run.steady_start:
            drive, m = with_rest(drive), after_steps(m, REST_STEPS)
        ready.append((name, drive, start, m))
    starts = _starts(model, runs, options)
    histories = [History(drive, start) for _, drive, start, _ in ready]
    snapshots = trained(model, parameters, starts, histories, options, also, earlier, progress)
    poses = np.unique(np.concatenate([np.flatnonzero(np.any(m.pose != 0.0, axis=0)) for *_, m in ready]))
    V = basis_for(model, snapshots, starts, poses, options)
    small = merged(model, V)
    prepared = prepare(small)
    effects = effects_of(small, parameters, starts)
    (body,) = small.bodies
    made = []
    for name, drive, start, m in ready:
        G = body.G.reshape(-1, 3, body.n)
        rows = Rows(
            m.tcp_step,
            m.tcp_share,
            np.tensordot(m.pose, G, 1),
            np.einsum("kp,epcr->ekcr", m.pose, np.asarray(effects.G).reshape(-1, len(model.poses), 3, body.n)),
        )
        z0 = (start - model.reference_temperature) * body.one
        made.append(FitRun(name, drive, start, m, loads_for(small, drive, options.substeps), rows, z0))
    return Problem(
        small, V, tuple(parameters), starts, tuple(made), prepared.layout, prepared.system,
        ContactPlaces.of(small.load_model), effects,
        options, tuple(snapshots),
    )  # fmt: skip


def _starts(model: MachineModel, runs: Sequence[Run], options: Options) -> tuple[Start, ...]:
    if options.initial_sigma <= 0.0:
        return ()
    members = [m for b in model.bodies for m in b.members] or [""]
    sigma, bound = options.initial_sigma, 10.0 * options.initial_sigma
    return tuple(
        Start(k, m, sigma, bound)
        for k, run in enumerate(runs)
        if run.initial_temperature is None and not run.steady_start  # a rest before the run forgets where it began
        for m in members
    )
