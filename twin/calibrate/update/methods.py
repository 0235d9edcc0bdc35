"""A run updated by one of the methods, from an artefact and a run folder: what `twin update` calls."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from twin.calibrate.update.gain import GainUpdater, PaperUpdater
from twin.calibrate.update.gain_filter import GainPrior
from twin.calibrate.update.plan import Plan
from twin.calibrate.update.program import SLEW, Live, Program, Updated, replay_update
from twin.calibrate.update.state import StateUpdater
from twin.calibrate.update.state_filter import StatePrior, machine_of
from twin.calibrate.update.state_tangent import KINDS, separate_loads
from twin.errors import LogError, ModelError
from twin.logs.run import Run
from twin.logs.signals import signal_values
from twin.progress import Progress, silent
from twin.rom.artefact import Artefact
from twin.rom.drive import evaluate, measured_air
from twin.run.replay import replay
from twin.run.results import Result

Method = Literal["paper", "gain", "state"]


@dataclass(frozen=True)
class Options:
    """How a run is updated."""

    method: Method = "state"
    dt: float = 60.0  # s
    substeps: int = 1
    slew: float = SLEW  # m/s; the method of the paper has none
    tcp_noise: float = 1e-6  # m, of measurements without a sigma
    sensor_noise: float = 0.1  # K
    gain: GainPrior = GainPrior()
    state: StatePrior = StatePrior()


def update_run(
    artefact: Artefact,
    run: Run,
    options: Options = Options(),
    plan: Plan | None = None,
    progress: Progress = silent,
    base: Result | None = None,
) -> tuple[Updated, Live[Any], Program[Any]]:
    """Replay a run online with the method of `options`: what it was, the state at its end, the program to go on with.

    base: the run's replay, where it is at hand.

    Raises ModelError for the method "state" where the artefact declares no parameters that it knows, LogError for
    missing signals and runs without TCP measurements.
    """
    model = artefact.model
    if base is None:
        base = replay(artefact, run, options.dt, options.substeps, progress=progress)
    if options.method == "paper":
        paper = Program(PaperUpdater(model, base), model, options.dt, 0.0)
        return *replay_update(paper, options.method, run, base, plan, (), progress), paper
    if options.method == "gain":
        prior = replace(options.gain, noise=options.tcp_noise)
        gain = Program(GainUpdater(model, base, prior), model, options.dt, options.slew)
        return *replay_update(gain, options.method, run, base, plan, (), progress), gain
    if not any(p.kind in KINDS for p in artefact.parameters):
        raise ModelError(
            "the artefact declares no losses, films or joints as parameters",
            model.name,
            "build it again with `twin build`, or choose --method gain",
        )
    state_prior = replace(options.state, sensor_noise=options.sensor_noise, tcp_noise=options.tcp_noise)
    signals = signal_values(run, model.load_model.signals)
    drive = evaluate(model.load_model, run.loads.time, signals, options.dt)
    if run.steady_start:
        raise LogError(
            'initial_temperature = "steady"', str(run.folder / "run.toml"),
            "the state filter starts at one temperature: give it, or choose --method gain",
        )  # fmt: skip
    start = run.initial_temperature
    if start is None:
        start = float(measured_air(model.load_model, drive)[0, model.load_model.surroundings])
    loads = separate_loads(model.load_model, drive, options.substeps)
    updater = StateUpdater(machine_of(artefact, state_prior), loads, options.dt, float(drive.time[0]), start)
    state = Program(updater, model, options.dt, options.slew)
    return *replay_update(state, options.method, run, base, plan, model.sensors, progress), state


def learnt(artefact: Artefact, live: Live[Any]) -> dict[str, tuple[float, float]]:
    """What the method "state" has learnt of each parameter: value [SI] and standard deviation, of the logarithm where
    the parameter is a factor."""
    chosen = [p for p in artefact.parameters if p.kind in KINDS]
    n_states = artefact.model.n
    found = {}
    for k, p in enumerate(chosen):
        u = float(live.state.extra[k])
        value = p.nominal * float(np.exp(u)) if p.scale == "log" else p.nominal + u
        found[p.path] = (value, float(np.linalg.norm(live.state.root[n_states + k])))
    return found
