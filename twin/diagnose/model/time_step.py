"""How long the steps of a diagnosis are: a minute, and shorter where a light part would be lost in that.

Films and losses follow the state at the beginning of a step. A bearing of little mass, whose friction falls as it
warms, loses most of that within a minute: in steps of a minute it is tenths of a kelvin off in every run, which would
be told as a cause where nothing is hidden.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.build.cache import arrays_hash, cached, machine_hash
from twin.calibrate.fit.effects import effects_of
from twin.diagnose.model.integration import stands_still, states_of
from twin.diagnose.model.probed_loads import loads_for
from twin.diagnose.model.probed_model import STEP, ProbedModel, drive_arrays, drive_of
from twin.diagnose.model.slots import no_slots
from twin.diagnose.model.study import start_of
from twin.logs.run import Run
from twin.machine.description import Machine

ERROR = (
    0.1  # K, rms at the worst sensor; chosen above what a minute is off beside nuts of five_axis, 0.06 (by a script)
)
SHORTEST = STEP / 16  # s


def time_step(machine: Machine, probed: ProbedModel, runs: Sequence[Run]) -> float:
    """The longest step [s] of STEP, STEP / 2, ... whose halves change no sensor by more than ERROR (rms over a run) as
    described, SHORTEST at least; kept by the machine and the runs' loads."""

    def make() -> float:
        dt = STEP
        coarse = [_temperatures(probed, run, k, dt) for k, run in enumerate(runs)]
        while dt > SHORTEST:
            fine = [_temperatures(probed, run, k, dt / 2) for k, run in enumerate(runs)]
            if max(map(step_error, coarse, fine), default=0.0) < ERROR:
                break
            dt, coarse = dt / 2, fine
        return dt

    loads = arrays_hash(
        a for run in probed.runs for a in (np.array([run.begins.temperature]), *drive_arrays(run.drive))
    )
    return float(cached("step", __name__, (machine_hash(machine), loads), make))


def step_error(coarse: np.ndarray, fine: np.ndarray) -> float:
    """K, rms at the worst of s sensors: of temperatures (n + 1, s) beside those in half the steps, (2 n + 1, s) or one
    less, where a log ends within a step."""
    n = (len(fine) + 1) // 2
    return float(np.sqrt(np.mean((coarse[:n] - fine[::2]) ** 2, axis=0)).max(initial=0.0))


def _temperatures(probed: ProbedModel, run: Run, k: int, dt: float) -> np.ndarray:
    """(n + 1, s) of all sensors in run k as described, in steps of dt [s]."""
    model = probed.base
    drive = drive_of(model, run, dt)
    loads, none = loads_for(model, drive), no_slots(drive.n_steps, 0, model.n, model)
    states = states_of(
        probed.layout, probed.contacts, False, stands_still(probed.layout, loads, none), probed.ports_first,
        effects_of(model, (), ()), loads, none, start_of(model, probed.runs[k]), np.zeros(0),
    )  # fmt: skip
    (body,) = model.bodies
    return np.asarray(states @ body.C.T)
