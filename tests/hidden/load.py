"""Truths of hidden-effect trials, small enough for the repository: what a machine did, without noise.

tests/hidden/truth/NAME.npz holds the runs for diagnosis of one machine: temperatures at every row of the log in steps
of RESOLUTION, as differences along time (compressed to a few bits each), TCP rows in steps of TCP_RESOLUTION. Written
by `benchmarks.hidden_store`, which needs gmsh and minutes; read with numpy alone.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from twin.atomic import atomic_path
from twin.logs.read import read_run
from twin.logs.run import Run, Table, Tcp

TRUTH = Path(__file__).parent / "truth"
MODEL = Path(__file__).parents[2] / "models" / "five_axis"
RUNS = ("diagnosis_1", "diagnosis_2", "diagnosis_sealed")  # the last is kept for judging

MEASURED_EVERY, PLACES, APART = 1800.0, 3, 60.0  # s, places of the TCP one after the other, s between them
RESOLUTION, TCP_RESOLUTION = 0.005, 2e-8  # K, m: a tenth of the noise at most
NOISE, TCP_NOISE = 0.08, 1e-6  # K, m, standard deviations


@dataclass(frozen=True)
class Truth:
    """What the machine did in one run, without noise."""

    run: str
    time: np.ndarray  # (n,) s
    temperatures: np.ndarray  # (n, n_sensors) degC
    sensors: tuple[str, ...]
    tcp_time: np.ndarray  # (m,) s
    positions: np.ndarray  # (m, 3) m, of the linear axes
    tcp: np.ndarray  # (m, 3) m


def plan(run: Run, axes: Sequence[str] = ("x", "y", "z")) -> tuple[np.ndarray, np.ndarray]:
    """Times (m,) [s] and positions (m, axes) [m] at which the TCP is measured: where the log has the axes then."""
    t = run.loads.time
    every = np.arange(MEASURED_EVERY, t[-1] + 1.0, MEASURED_EVERY)
    when = (every[:, None] - APART * np.arange(PLACES)[::-1]).ravel()
    return when, np.column_stack([np.interp(when, t, run.loads.columns[f"{a}_position"]) for a in axes])


def measured(truth: Truth, seed: int, noise: float = NOISE, tcp_noise: float = TCP_NOISE) -> Run:
    """The run as it was logged and measured: noise [K], [m] of white Gaussian kind, drawn by `seed` and the run."""
    run = read_run(MODEL / "runs" / truth.run)
    rng = np.random.default_rng([seed, RUNS.index(truth.run)])
    T = truth.temperatures + noise * rng.standard_normal(truth.temperatures.shape)
    tcp = truth.tcp + tcp_noise * rng.standard_normal(truth.tcp.shape)
    return Run(
        loads=run.loads,
        temperatures=Table(
            truth.time, dict(zip(truth.sensors, T.T, strict=True)), dict.fromkeys(truth.sensors, "degC")
        ),
        tcp=Tcp(
            truth.tcp_time,
            ("x", "y", "z"),
            truth.positions,
            tcp,
            np.full(len(tcp), tcp_noise) if tcp_noise > 0.0 else None,
        ),
        start=run.start,
        zone=run.zone,
        sampling=run.sampling,
        provenance=f"another machine on another mesh, noise seed {seed}",
        synthetic=("loads", "temperatures", "tcp"),
        initial_temperature=run.initial_temperature,
        folder=run.folder,
    )


def load(name: str, seed: int = 0) -> tuple[tuple[Run, ...], dict[str, Any]]:
    """The runs of a stored trial with noise of a seed, in the order of RUNS, and what is hidden in them."""
    found, about = read(name)
    return tuple(measured(truth, seed) for truth in found), about


def names() -> tuple[str, ...]:
    """The stored trials."""
    return tuple(sorted(path.stem for path in TRUTH.glob("*.npz")))


def read(name: str, folder: Path = TRUTH) -> tuple[tuple[Truth, ...], dict[str, Any]]:
    """The truths of a stored trial, and what is hidden in them."""
    with np.load(folder / f"{name}.npz") as data:
        sensors = tuple(str(s) for s in data["sensors"])
        found = []
        for run in (r for r in RUNS if f"{r}.steps" in data):
            when, where = plan(read_run(MODEL / "runs" / run))
            steps = np.cumsum(data[f"{run}.steps"].astype(np.int64), axis=1).T
            time = data[f"{run}.every"] * np.arange(len(steps))
            tcp = TCP_RESOLUTION * data[f"{run}.tcp"]
            found.append(Truth(run, time, RESOLUTION * steps, sensors, when, where, tcp))
        return tuple(found), json.loads(str(data["about"]))


def write(name: str, truths: Sequence[Truth], about: Mapping[str, object], folder: Path = TRUTH) -> Path:
    """Store the truths of a trial; about: what is hidden, as JSON can say it. All runs have the same sensors."""
    arrays: dict[str, np.ndarray] = {"sensors": np.array(truths[0].sensors), "about": np.array(json.dumps(about))}
    for truth in truths:
        steps = np.round(truth.temperatures / RESOLUTION).astype(np.int64).T
        # by sensor: neighbours in the file are alike, which is what compression lives on
        arrays[f"{truth.run}.steps"] = _int16(np.diff(steps, axis=1, prepend=0))
        arrays[f"{truth.run}.every"] = np.array(truth.time[1] - truth.time[0])
        arrays[f"{truth.run}.tcp"] = _int16(np.round(truth.tcp / TCP_RESOLUTION))
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.npz"
    with atomic_path(path) as temporary, Path(temporary).open("wb") as f:
        np.savez_compressed(f, **arrays)
    return path


def _int16(steps: np.ndarray) -> np.ndarray:
    """Raises ValueError where 16 bits do not hold them: beyond 160 degC, or 655 um."""
    if not np.all(np.abs(steps) <= np.iinfo(np.int16).max):  # NaN too
        raise ValueError("no temperatures or TCP deviations of a machine tool")
    return steps.astype(np.int16)
