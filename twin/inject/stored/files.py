"""Truths that are small enough for a repository: what a machine did in the runs of an experiment, without noise.

A file (.npz) holds temperatures at every row of the log in steps of RESOLUTION, as differences along time (compressed
to a few bits each), and TCP rows in steps of TCP_RESOLUTION. Read with numpy alone.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from twin.atomic import atomic_path
from twin.inject.experiment import NOISE, RUNS, TCP_NOISE, Experiment, plan
from twin.logs.run import Run, Table, Tcp

RESOLUTION, TCP_RESOLUTION = 0.005, 2e-8  # K, m: a tenth of the noise at most


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


def measured(
    experiment: Experiment, truth: Truth, seed: int, noise: float = NOISE, tcp_noise: float = TCP_NOISE
) -> Run:
    """The run as it was logged and measured: noise [K], [m] of white Gaussian kind, drawn by `seed` and the run."""
    run = experiment.run(truth.run)
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


def read(experiment: Experiment, path: Path) -> tuple[tuple[Truth, ...], dict[str, Any]]:
    """The truths of a file, and what is hidden in them."""
    with np.load(path) as data:
        sensors = tuple(str(s) for s in data["sensors"])
        found = []
        for run in (r for r in RUNS if f"{r}.steps" in data):
            when, where = plan(experiment.run(run))
            steps = np.cumsum(data[f"{run}.steps"].astype(np.int64), axis=1).T
            time = data[f"{run}.every"] * np.arange(len(steps))
            tcp = TCP_RESOLUTION * data[f"{run}.tcp"]
            found.append(Truth(run, time, RESOLUTION * steps, sensors, when, where, tcp))
        return tuple(found), json.loads(str(data["about"]))


def write(path: Path, truths: Sequence[Truth], about: Mapping[str, object]) -> None:
    """Store truths; about: what is hidden, as JSON can say it. All runs have the same sensors.

    Raises ValueError for what is no temperature or TCP deviation of a machine tool.
    """
    arrays: dict[str, Any] = {"sensors": np.array(truths[0].sensors), "about": np.array(json.dumps(about))}
    for truth in truths:
        steps = np.round(truth.temperatures / RESOLUTION).astype(np.int64).T
        # by sensor: neighbours in the file are alike, which is what compression lives on
        arrays[f"{truth.run}.steps"] = _int16(np.diff(steps, axis=1, prepend=0))
        arrays[f"{truth.run}.every"] = np.array(truth.time[1] - truth.time[0])
        arrays[f"{truth.run}.tcp"] = _int16(np.round(truth.tcp / TCP_RESOLUTION))
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_path(path) as temporary, Path(temporary).open("wb") as f:
        np.savez_compressed(f, **arrays)


def _int16(steps: np.ndarray) -> np.ndarray:
    """Raises ValueError where 16 bits do not hold them: beyond 160 degC, or 655 um."""
    if not np.all(np.abs(steps) <= np.iinfo(np.int16).max):  # NaN too
        raise ValueError("no temperatures or TCP deviations of a machine tool")
    return steps.astype(np.int16)
