"""A run replayed on the reduced machine: loads in, temperatures, TCP error and heat balance out."""

from __future__ import annotations

import twin.run.jax_setup  # noqa: F401  isort: skip

from dataclasses import replace
from itertools import pairwise

import jax
import numpy as np

from twin.errors import TwinError
from twin.logs.run import Run
from twin.logs.signals import signal_values
from twin.progress import Progress, silent
from twin.rom.artefact import Artefact
from twin.rom.drive import Drive, evaluate, measured_air
from twin.rom.following_flags import following_flags
from twin.rom.model import MachineModel
from twin.rom.poses import outside_grid
from twin.rom.rest import rest_before
from twin.rom.tcp import by_body, is_exact, places, tcp_at
from twin.run.checkpoint import CheckpointFolder, Steps, chain
from twin.run.plausible import refuse_glowing, refuse_not_finite, refuse_unbalanced
from twin.run.results import Result
from twin.run.step_length import refuse_step_length
from twin.run.stepping import Inputs, advance, inputs_of, observe
from twin.run.system import Prepared, prepare

# Steps go through in blocks of one size, the last one padded: one compiled function for runs of any length, and the
# same arithmetic, bit by bit, wherever a run is taken up again.
BLOCK = 64


def replay(
    artefact: Artefact,
    run: Run,
    dt: float = 60.0,
    substeps: int | None = None,
    initial: float | np.ndarray | None = None,
    checkpoints: CheckpointFolder | None = None,
    progress: Progress = silent,
) -> Result:
    """Step the artefact's model through the loads of a run.

    dt [s] and substeps: outputs every dt, in so many steps of the integrator; None: as many as the certificate is for.
    initial: temperature of the whole machine [degC], or a state (N,) in artefact coordinates (`Result.state`,
    `twin.run.results.read_final_state`); by default the run's own initial temperature or its steady state
    (`twin.rom.rest`), else the first mean of its surroundings.

    Raises LogError for missing signals and bad times, TwinError for checkpoints of another run, and steps longer than
    the log or too many, FailedCheck for results that cannot be (`twin.run.plausible`).
    """
    model = artefact.model
    refuse_step_length(run.loads.time, dt, model.n + 3 * len(model.poses) + len(model.sensors))
    signals = signal_values(run, model.load_model.signals)
    drive = evaluate(model.load_model, run.loads.time, signals, dt)
    if initial is None:
        air = float(measured_air(model.load_model, drive)[0, model.load_model.surroundings])
        initial = air if run.initial_temperature is None else run.initial_temperature
        if run.steady_start:
            initial = at_rest(model, drive, air)
    # a position that is not logged is at its default all the time
    first = [signals.get(axis.position, drive.position[:, k]) for k, axis in enumerate(model.load_model.axes)]
    first += [signals.get(axis.position, drive.angle[:, k]) for k, axis in enumerate(model.load_model.rotary)]
    position = np.array([values[np.argmax(np.isfinite(values))] for values in first])
    return replay_drive(artefact, drive, position, substeps, initial, checkpoints, progress)


def at_rest(model: MachineModel, drive: Drive, near: float) -> np.ndarray:
    """State (N,) in artefact coordinates of a machine that rested before `drive` began; near [degC]: a first guess."""
    prepared = prepare(model)
    inputs = inputs_of(model.load_model, rest_before(drive), 1)
    return prepared.to_artefact(integrate(prepared, inputs, prepared.uniform(near)).z[-1])


def replay_drive(
    artefact: Artefact,
    drive: Drive,
    position: np.ndarray,
    substeps: int | None,
    initial: float | np.ndarray,
    checkpoints: CheckpointFolder | None = None,
    progress: Progress = silent,
) -> Result:
    """The same for loads that are evaluated already. See `replay`.

    position (n_axes,) [m] at the start, behind it the angles [rad] of the rotary axes that turn.
    """
    model = artefact.model
    if substeps is None:
        substeps = int(artefact.certificate.get("substeps", 1))
    prepared = prepare(model)
    start = prepared.uniform(initial) if isinstance(initial, float | int) else prepared.from_artefact(initial)
    steps = integrate(
        prepared, inputs_of(model.load_model, drive, substeps), start, artefact.digest, checkpoints, progress
    )
    states = np.concatenate([start[None], steps.z])
    refuse_not_finite(drive.time, states)
    temperature, tcp = _observe(prepared, states)
    _refuse_glowing(prepared, model, drive.time, states, temperature)
    air = measured_air(model.load_model, drive)[:, [i for _, i in model.ambient_sensors]]
    axes = [a.name for a in model.load_model.axes]
    everything = np.concatenate([position[None], np.hstack([drive.position, drive.angle])])
    positions = everything[:, : len(axes)]
    to_poses = places(model, positions, everything[:, len(axes) :])
    outside = outside_grid(model.pose_grid, to_poses[:, : len(model.pose_axes)])
    flags = {"position outside the pose grid, TCP error of its border": outside[1:] | outside[:-1]}
    modal = prepared.to_artefact(states)
    certified = artefact.certificate.get("step")
    if certified is not None:
        # shorter steps excite faster modes than the certificate has seen
        its_own = float(certified) / float(artefact.certificate.get("substeps", substeps))
        shortest = float(artefact.certificate.get("finest_step", its_own))
        flags[f"substep shorter than the certified {shortest:g} s"] = np.diff(drive.time) / substeps < 0.999 * shortest
        # laws that follow a temperature read it at the step's start: over hours they would swing to and fro
        longest = float(certified)
        flags[f"step longer than the certified {longest:g} s"] = np.diff(drive.time) > 1.001 * longest
    system = prepared.system
    plan = jax.tree.map(np.asarray, system).film_plan
    flags |= following_flags(model.load_model, drive, plan, steps.theta, steps.surface, steps.winding)
    throughput = np.diff(drive.time) * (np.abs(steps.power).sum(axis=1) + steps.gross)
    residual = steps.stored - np.diff(drive.time) * (steps.power.sum(axis=1) + steps.film.sum(axis=1))
    balance_error = np.abs(residual) / np.maximum(throughput, 1e-6 * prepared.heat_capacity)
    refuse_unbalanced(drive.time, balance_error)
    return Result(
        time=drive.time,
        sensors=model.all_sensors,
        temperature=np.hstack([temperature, np.concatenate([air[:1], air])]),
        pose_axes=model.pose_axes,
        poses=model.poses,
        tcp=tcp,
        axes=tuple(axes),
        position=positions,
        tcp_actual=tcp_at(model, by_body(model, modal), to_poses),
        sources=tuple(s.name for s in model.load_model.sources),
        power=steps.power,
        films=tuple(f.name for f in model.load_model.films),
        film_heat=steps.film,
        film_coefficient=steps.theta[:, : len(model.load_model.films)],
        film_surface=steps.surface,
        stored=steps.stored,
        balance_error=balance_error,
        flags=np.column_stack([drive.flags, *flags.values()]),
        flag_names=(*drive.flag_names, *flags),
        states=modal,
        artefact=artefact.digest,
        substeps=substeps,
        moves=model.moves,
        turning=model.turning,
        angle=everything[:, len(axes) :],
        exact=is_exact(model),
    )


def _refuse_glowing(
    prepared: Prepared, model: MachineModel, time: np.ndarray, states: np.ndarray, temperature: np.ndarray
) -> None:
    """Sensors, and the mean of every body: a machine may have none."""
    system, offsets = prepared.system, prepared.layout.offsets
    energy, one = np.asarray(system.energy), np.asarray(system.one)
    own = [slice(a, b) for a, b in pairwise(offsets)]
    means = [states[:, rows] @ energy[rows] / (one[rows] @ energy[rows]) for rows in own]
    names = (*(f"body {body.name}" for body in model.bodies), *(f"sensor {name}" for name in model.sensors))
    refuse_glowing(time, np.column_stack([*means, temperature - model.reference_temperature]), names)


def integrate(
    prepared: Prepared,
    inputs: Inputs,
    start: np.ndarray,
    identity: str = "",
    checkpoints: CheckpointFolder | None = None,
    progress: Progress = silent,
) -> Steps:
    """All steps of `inputs` from state `start` (N,); `identity` names the model in checkpoints.

    Raises TwinError for checkpoints of another run and for checkpoints that cannot be read or written.
    """
    n_steps = len(inputs.changed)
    key = chain(identity, start, np.array(BLOCK), np.array(inputs.substeps))
    done: list[Steps] = []
    first, z = 0, start
    if checkpoints is not None and checkpoints.resume:
        for begin, steps, saved in checkpoints.load():
            end = begin + len(steps.stored)
            expected = chain(key, *jax.tree.leaves(_part(inputs, begin, end))) if end <= n_steps else ""
            if begin != first or saved != expected or end % BLOCK:
                break
            done.append(steps)
            first, z, key = end, steps.z[-1], saved
        if first == 0 and checkpoints.load():
            raise TwinError(
                "the checkpoints are of another run, artefact or step",
                str(checkpoints.folder),
                "run without --resume to start afresh, or with the options of the interrupted run",
            )
    elif checkpoints is not None:
        checkpoints.clear()
    fresh: list[Steps] = []
    with progress("time steps", -(-(n_steps - first) // BLOCK)) as advanced:
        for begin in range(first, n_steps, BLOCK):
            end = min(begin + BLOCK, n_steps)
            states, heat = advance(prepared.layout, prepared.system, z, _block(inputs, begin, end))
            made = (states, heat.film, heat.gross, heat.stored, heat.power, heat.theta, heat.surface, heat.winding)
            steps = Steps(*(np.asarray(a)[: end - begin] for a in made))
            done.append(steps)
            fresh.append(steps)
            z = steps.z[-1]
            if checkpoints is not None and end - first >= checkpoints.every and end - begin == BLOCK:
                key = chain(key, *jax.tree.leaves(_part(inputs, first, end)))
                checkpoints.save(first, Steps.join(fresh), key)
                first, fresh = end, []
            advanced(f"{end} of {n_steps}")
    return Steps.join(done)


def _part(inputs: Inputs, begin: int, end: int) -> Inputs:
    """Some of the stacked steps; the first one factorises."""
    part = jax.tree.map(lambda a: a[begin:end], inputs)
    return replace(part, changed=np.concatenate([[True], part.changed[1:]]))


def _block(inputs: Inputs, begin: int, end: int) -> Inputs:
    """The steps padded to BLOCK with copies of the last one, which change no factor."""
    part = _part(inputs, begin, end)
    missing = BLOCK - (end - begin)
    if missing == 0:
        return part
    padded = jax.tree.map(lambda a: np.concatenate([a, np.repeat(a[-1:], missing, axis=0)]), part)
    return replace(padded, changed=np.concatenate([part.changed, np.zeros(missing, dtype=bool)]))


def _observe(prepared: Prepared, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Structural sensors (n, n_sensors) degC and TCP displacements (n, n_poses, 3) m, in blocks of one size."""
    results = []
    for begin in range(0, len(states), BLOCK):
        block = states[begin : begin + BLOCK]
        padded = np.concatenate([block, np.zeros((BLOCK - len(block), states.shape[1]))])
        temperature, tcp = observe(prepared.system, padded)
        results.append((np.asarray(temperature)[: len(block)], np.asarray(tcp)[: len(block)]))
    temperatures, tcps = zip(*results, strict=True)
    return np.concatenate(temperatures), np.concatenate(tcps)
