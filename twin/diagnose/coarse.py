"""Family 16: the artefact's own runtime against the larger model of the diagnosis, on the loads of the runs."""

from __future__ import annotations

import numpy as np

from twin.calibrate.fit.training import states_at
from twin.diagnose.diagnosis import Cause
from twin.diagnose.study import Study
from twin.rom.model import MachineModel

COARSE = 1.0  # of a sensor's or the probe's noise: a model may differ by this (rms)


def coarse_model(model: MachineModel, study: Study, temperature_sigma: float, tcp_sigma: float) -> Cause | None:
    """The cause, where a model differs from the probed model's by more than COARSE in a fitted run, both as described.

    temperature_sigma [K], tcp_sigma [m]: of one reading.
    """
    worst = 0.0
    if model.n == study.probed.base.n and study.probed.reduction == (0.0, 0.0):
        return None  # a lumped machine with all its states: what is left are the probed model's own time steps
    for k in study.fitted:
        planned = study.runs[k]
        if tuple(model.sensors) != tuple(study.probed.base.sensors):
            return None
        one = np.concatenate([b.one for b in model.bodies])
        start = (planned.run.start - model.reference_temperature) * one
        states = states_at(model, (), {}, planned.run.drive, start, 4)
        T = np.full((len(states), len(model.sensors)), model.reference_temperature)
        first = 0
        m = planned.measured
        w = np.zeros((len(m.tcp), 3))
        for body in model.bodies:
            own = states[:, first : first + body.n]
            T[:, list(body.sensors)] += own @ body.C.T
            at = own[m.tcp_step] + m.tcp_share[:, None] * (own[m.tcp_step + 1] - own[m.tcp_step])
            w += np.einsum("kp,pcn,kn->kc", m.pose, body.G, at)
            first += body.n
        w = w - w[0] if m.from_first else w
        here, tcp = planned.split(study.outputs(k, np.zeros(len(study.probed.parameters))))
        error = np.sqrt(np.mean((m.mean_of @ T[:, m.column] - here) ** 2, axis=0)).max(initial=0.0)
        moved = np.sqrt(np.mean((w - tcp) ** 2, axis=0)).max(initial=0.0) if len(w) else 0.0
        worst = max(worst, float(error) / temperature_sigma, float(moved) / tcp_sigma)
    if worst <= COARSE:
        return None
    return Cause(
        "coarse_model", "artefact", "", worst, (worst, worst), "1", worst, COARSE,
        history=f"differs from a larger model by {worst:.1f} times the noise of a reading",
    )  # fmt: skip
