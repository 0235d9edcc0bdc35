"""A lumped machine with runs whose truth comes from a finer model with planted parameters."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from twin.build.full_model import FullModel, assemble
from twin.build.pipeline import BuildOptions, rich_model
from twin.build.simulate import simulate
from twin.logs.read import read_run
from twin.logs.run import Run, Table, Tcp
from twin.logs.signals import signal_values
from twin.machine.load import load_machine
from twin.machine.parameters import parameters
from twin.rom.apply import with_values
from twin.rom.artefact import Artefact
from twin.rom.drive import evaluate

FOLDER = Path(__file__).parents[1] / "machines" / "spindle"
NOISE_TEMPERATURE, NOISE_TCP = 0.05, 0.3e-6


@cache
def artefact() -> Artefact:
    machine = load_machine(FOLDER)
    model = rich_model(machine, None, BuildOptions().rich)
    text = (FOLDER / "machine.toml").read_text(encoding="utf-8")
    return Artefact(model, text, {}, {"machine": str(FOLDER)}, (), parameters(machine), "", "spindle")


@cache
def finer() -> FullModel:
    """The same machine with a screw of three times as many elements."""
    machine = load_machine(FOLDER)
    bars = {name: bar.model_copy(update={"elements": 3 * bar.elements}) for name, bar in machine.bars.items()}
    return assemble(machine.model_copy(update={"bars": bars}))


def truth(values: dict[str, float], seed: int = 0, noise: float = 1.0, name: str = "truth") -> Run:
    """The shipped run of the finer machine at these values, with noise: temperatures every minute, TCP every 20 min."""
    (folder,) = [f for f in (FOLDER / "runs").iterdir() if f.is_dir()]
    run = read_run(folder)
    full = finer()
    thermal = with_values(full.thermal, artefact().parameters, values)
    drive = evaluate(thermal.load_model, run.loads.time, signal_values(run, thermal.load_model.signals), 60.0)
    when = np.arange(1200.0, drive.time[-1] + 1.0, 1200.0)
    where = np.random.default_rng(3).uniform(-0.1, 0.3, (len(when), len(thermal.pose_axes)))
    start = run.initial_temperature if run.initial_temperature is not None else 20.0
    made = simulate(FullModel(thermal, full.structure, (), ()), drive, when, where, start)
    rng = np.random.default_rng(seed)
    T = made.temperatures + noise * NOISE_TEMPERATURE * rng.standard_normal(made.temperatures.shape)
    w = made.tcp + noise * NOISE_TCP * rng.standard_normal(made.tcp.shape)
    columns = dict(zip(made.sensors, T.T, strict=True))
    return replace(
        run,
        temperatures=Table(made.time, columns, dict.fromkeys(columns, "degC")),
        tcp=Tcp(made.tcp_time, thermal.pose_axes, made.tcp_positions, w, np.full(len(w), NOISE_TCP)),
        initial_temperature=start,
        folder=Path(name),
    )
