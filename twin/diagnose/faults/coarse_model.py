"""The artefact does not follow its own full model: a note and no cause, as the diagnosis has a larger one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.calibrate.fit.training import states_at
from twin.diagnose.faults.context import Singly
from twin.diagnose.faults.fault import Family, Fault
from twin.diagnose.model.study import Study, start_of
from twin.rom.model import MachineModel
from twin.rom.tcp import by_body, is_exact, tcp_at

COARSE = 1.0  # of a sensor's or the probe's noise: a model may differ by this (rms)
BETWEEN = ", interpolated between its poses"
SUBSTEPS = 4  # of a minute: finer steps than the runtime's, so that what differs are the models
FAULTS: tuple[Fault, ...] = ()  # it is computed, and not searched

FAMILY = Family(
    16, "coarse_model", "Reduced model or time step too coarse",
    "The artefact does not follow its own full model on this input: a note, never a cause.",
    "none: more states, a shorter step", "the artefact differs from the full model; the full model fits",
    "the noise of one reading (rms)", "-", "the artefact's runtime against the larger model of the diagnosis",
    "reading", Singly(FAULTS), what="model too coarse",
)  # fmt: skip


@dataclass(frozen=True)
class Coarse:
    """How far an artefact is from the larger model."""

    times: float  # the noise of a reading (rms)
    note: str


def too_coarse(model: MachineModel, study: Study, temperature_sigma: float, tcp_sigma: float) -> Coarse | None:
    """Of an artefact that differs from the probed model by more than COARSE times the noise of one reading
    (temperature_sigma [K], tcp_sigma [m]) in a fitted run, both as described."""
    base = study.probed.base
    if model.n == base.n and study.probed.reduction == (0.0, 0.0):
        return None  # a lumped machine with all its states: what is left are the probed model's own time steps
    if tuple(model.sensors) != tuple(base.sensors):
        return None
    most, told = COARSE, ""
    for k in study.fitted:
        planned = study.runs[k]
        m = planned.measured
        states = states_at(model, (), {}, planned.run.drive, start_of(model, planned.run), SUBSTEPS)
        T = np.full((len(states), len(model.sensors)), model.reference_temperature)
        for body, own in zip(model.bodies, by_body(model, states), strict=True):
            T[:, list(body.sensors)] += own @ body.C.T
        here, tcp = planned.split(study.outputs(k, np.zeros(len(study.probed.parameters))))
        apart = np.sqrt(np.mean((m.mean_of @ T[:, m.column] - here) ** 2, axis=0))
        if apart.max(initial=0.0) > most * temperature_sigma:
            most = float(apart.max()) / temperature_sigma
            told = f"{apart.max():.3g} K (rms) at sensors.{m.sensors[int(apart.argmax())]} in {m.name}"
        if len(m.tcp):
            at = states[m.tcp_step] + m.tcp_share[:, None] * (states[m.tcp_step + 1] - states[m.tcp_step])
            w = tcp_at(model, by_body(model, at), m.position)
            moved = np.sqrt(np.mean((w - (w[0] if m.from_first else 0.0) - tcp) ** 2, axis=0))
            if moved.max(initial=0.0) > most * tcp_sigma:
                most = float(moved.max()) / tcp_sigma
                told = f"{1e6 * moved.max():.3g} um (rms) of d{'xyz'[int(moved.argmax())]} in {m.name}"
                told += "" if is_exact(model) else BETWEEN
    if not told:
        return None
    remedy = "build it with more --states for `twin run`"
    if told.endswith(BETWEEN):
        remedy = "artefacts built by this version do not interpolate"
    return Coarse(
        most,
        f"the artefact differs from the larger model of this diagnosis by {told}, {most:.1f} times the noise of a "
        f"reading: {remedy}. The diagnosis goes by the larger model.",
    )
