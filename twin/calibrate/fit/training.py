"""Trajectories of the artefact's own runtime that a window model is made from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from twin.calibrate.fit.effects import Start
from twin.calibrate.fit.options import Options
from twin.calibrate.fit.window import window_basis
from twin.errors import TwinError
from twin.progress import Progress, silent
from twin.rom.apply import member_field, with_values
from twin.rom.drive import Drive
from twin.rom.model import MachineModel
from twin.rom.parameter import Parameter
from twin.rom.rescale import rescaled
from twin.run.replay import integrate
from twin.run.stepping import inputs_of
from twin.run.system import prepare

SPREAD = 1.2  # prior standard deviations of the draws
EVERY = 2  # steps between snapshots


@dataclass(frozen=True)
class History:
    """What drives a run at nominal parameters, and where it starts."""

    drive: Drive
    start: float  # degC


def fields_of(model: MachineModel, starts: Sequence[Start]) -> np.ndarray:
    """(N, f): what initial corrections add to the states, of each member once."""
    columns = []
    for member in dict.fromkeys(s.member for s in starts if s.member):
        parts = [
            member_field(b, b.members.index(member)) if member in b.members else np.zeros(b.n) for b in model.bodies
        ]
        columns.append(np.concatenate(parts))
    return np.column_stack(columns) if columns else np.zeros((model.n, 0))


def states_at(
    model: MachineModel,
    parameters: Sequence[Parameter],
    values: dict[str, float],
    drive: Drive,
    start: np.ndarray,
    substeps: int,
) -> np.ndarray:
    """States (n_steps + 1, N) of the artefact's own runtime at other values, in artefact coordinates."""
    there = with_values(model, parameters, values)
    prepared = prepare(there)
    inputs = inputs_of(there.load_model, rescaled(drive, model.load_model, there.load_model), substeps)
    z0 = prepared.from_artefact(start)
    z = integrate(prepared, inputs, z0).z
    return prepared.to_artefact(np.concatenate([z0[None], z]))


def trained(
    model: MachineModel,
    parameters: Sequence[Parameter],
    starts: Sequence[Start],
    histories: Sequence[History],
    options: Options,
    also: Sequence[Mapping[str, float]] = (),
    earlier: Sequence[np.ndarray] = (),
    progress: Progress = silent,
) -> list[np.ndarray]:
    """Snapshots (N, m) of every run: nominal, `options.draws` draws from the priors, and at the values in `also`.

    earlier: what an earlier call returned for the same runs: only the last of `also` is then stepped, and added.
    Raises TwinError where a draw does not stay finite.
    """
    rng = np.random.default_rng(options.seed)
    draws: list[dict[str, float]] = [{}]
    for _ in range(options.draws):
        x = np.clip(SPREAD * rng.standard_normal(len(parameters)), -2.5, 2.5)
        draws.append(
            {p.path: float(np.clip(p.value(float(c)), p.low, p.high)) for p, c in zip(parameters, x, strict=True)}
        )
    draws = [dict(also[-1])] if earlier else [*draws, *map(dict, also)]
    one, fields = np.concatenate([b.one for b in model.bodies]), fields_of(model, starts)
    work = []
    for values in draws:
        for history in histories:
            x0 = (history.start - model.reference_temperature) * one
            if fields.shape[1] and values:
                x0 = x0 + fields @ (options.initial_sigma * rng.standard_normal(fields.shape[1]))
            work.append((values, history.drive, x0))

    snapshots = list(earlier)
    with progress("window model", len(work)) as advance:
        for values, drive, x0 in work:
            states = states_at(model, parameters, values, drive, x0, options.substeps)
            if not np.isfinite(states).all():
                remedy = "narrow low and high of its parameters"
                raise TwinError("the model does not stay finite", "parameters", remedy)
            snapshots.append(states[::EVERY].T)
            advance("")
    return snapshots


def basis_for(
    model: MachineModel, snapshots: Sequence[np.ndarray], starts: Sequence[Start], poses: np.ndarray, options: Options
) -> np.ndarray:
    """V (N, r) for the sensors and the TCP at these poses (indices), in units of their noise."""
    C = np.hstack([_wide(b.C, b.sensors, len(model.sensors)) for b in model.bodies]) / options.temperature_sigma
    G = np.concatenate([b.G[poses].reshape(-1, b.n) for b in model.bodies], axis=1) / options.tcp_sigma
    return window_basis(
        model, snapshots, fields_of(model, starts), options.temperature_sigma, np.vstack([C, G]), options.tail
    )


def _wide(rows: np.ndarray, index: Sequence[int], n: int) -> np.ndarray:
    result = np.zeros((n, rows.shape[1]))
    result[list(index)] = rows
    return result
