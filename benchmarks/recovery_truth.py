"""Truth for planted parameters: the full model of the five-axis machine on another mesh, stepped through 12 h."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.five_axis import FOLDER, machine
from twin.atomic import atomic_path
from twin.build.cache import folder
from twin.build.full_model import FullModel
from twin.build.pipeline import full_model
from twin.build.remesh import remesh
from twin.build.simulate import Noise, simulate
from twin.logs.read import read_run
from twin.logs.run import Run, Table, Tcp
from twin.logs.signals import signal_values
from twin.machine.parameters import parameters
from twin.rom.apply import with_values
from twin.rom.drive import evaluate
from twin.rom.parameter import Parameter

RUN = FOLDER / "runs" / "identification"
OTHER_MESH = 0.16  # m, element size: the artefact's mesh has 0.12
NOISE = Noise(0.08, 1e-6)
SEEDS = range(20)
R_TEST_POSES = 5  # measured positions of an hourly R-test


@cache
def planted() -> tuple[Parameter, ...]:
    """The 30: gains of all 14 sources and 12 films, both heat capacities, both offsets of the air."""
    return tuple(p for p in parameters(machine()) if p.kind in ("source", "film", "capacity", "environment"))


def draw(seed: int) -> dict[str, float]:
    """Values of the planted parameters, drawn from their priors."""
    coordinates = np.random.default_rng(seed).standard_normal(len(planted()))
    return {p.path: p.value(float(c)) for p, c in zip(planted(), coordinates, strict=True)}


def plan(axes: int, n_hours: int) -> tuple[np.ndarray, np.ndarray]:
    """Times (m,) s and positions (m, axes) m of hourly R-tests over the workspace."""
    rng = np.random.default_rng(77)
    time = np.repeat(3600.0 * np.arange(1, n_hours + 1), R_TEST_POSES)
    return time, rng.uniform(-0.3, 0.3, (len(time), axes))


@cache
def other() -> FullModel:
    return full_model(remesh(machine(), OTHER_MESH))


def truth(seed: int) -> Run:
    """The run of a seed, with noise; the full model's outputs are kept in the cache folder."""
    path = folder() / f"recovery-{seed}.npz"
    run = read_run(RUN)
    if not path.exists():
        full = other()
        thermal = with_values(full.thermal, parameters(machine()), draw(seed))
        drive = evaluate(thermal.load_model, run.loads.time, signal_values(run, thermal.load_model.signals), 60.0)
        when, where = plan(len(thermal.pose_axes), round(drive.time[-1] / 3600.0))
        made = simulate(FullModel(thermal, full.structure, full.bodies, full.surfaces), drive, when, where, 22.0)
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_path(path) as temporary, Path(temporary).open("wb") as f:
            np.savez(f, time=made.time, temperatures=made.temperatures, sensors=np.array(made.sensors),
                     tcp_time=made.tcp_time, positions=made.tcp_positions, tcp=made.tcp)  # fmt: skip
    with np.load(path) as data:
        rng = np.random.default_rng(10_000 + seed)
        sensors = [str(s) for s in data["sensors"]]
        noisy = data["temperatures"] + NOISE.temperature * rng.standard_normal(data["temperatures"].shape)
        tcp = data["tcp"] + NOISE.displacement * rng.standard_normal(data["tcp"].shape)
        axes = machine().axes
        names = tuple(a for a in axes if axes[a].kind == "linear")
        return Run(
            loads=run.loads,
            temperatures=Table(data["time"], dict(zip(sensors, noisy.T, strict=True)), dict.fromkeys(sensors, "degC")),
            tcp=Tcp(data["tcp_time"], names, data["positions"], tcp, np.full(len(tcp), NOISE.displacement)),
            initial_temperature=22.0,
            folder=Path(f"truth-{seed}"),
        )


def main() -> None:
    for seed in SEEDS:
        truth(seed)
        print(f"   truth {seed} ready", flush=True)


if __name__ == "__main__":
    main()
