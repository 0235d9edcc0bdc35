"""Loads of drawn machines: axes that move and rest, spindles and pumps that are switched, air that swings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twin.machine.description import Machine, SignalEntry
from twin.units import to_si

TOP = 0.8  # of a signal's certified range: the largest value in a log
RESTS = 0.3  # share of blocks in which an axis or spindle rests
BLOCK = (900.0, 4500.0)  # s, of one job: parts of a small series
SWING = (0.8, 2.5)  # K, amplitude of the air over a day or a shift
START = 20.0  # degC, of machine and air
STRAINED = ("_current", "_power", "_torque")  # endings of signals of a drive that follow its load


@dataclass(frozen=True)
class LoadsOfRun:
    """The two files of a run folder of loads alone."""

    name: str
    loads: str  # loads.csv
    facts: str  # run.toml

    def write(self, folder: Path) -> None:
        """Write the run folder, which must not be there. Not atomically: the caller owns `folder`."""
        folder.mkdir(parents=True)
        (folder / "loads.csv").write_text(self.loads, encoding="utf-8")
        (folder / "run.toml").write_text(self.facts, encoding="utf-8")


def loads_of_run(
    machine: Machine, seed: int, name: str, hours: float, sampling: float, together: Mapping[str, str] = {}
) -> LoadsOfRun:
    """Loads [units of the signals] of `hours` every `sampling` [s] from a seed; the same seed gives the same bytes.

    Columns are told by their names, as `draw_machine` writes them: AXIS_position of the axes, AXIS_speed,
    AXIS_current and AXIS_screw_speed of the same motion; every other signal is an air temperature where its unit is
    one, a switch where its unit is 1, and a level that changes from job to job otherwise. together: signals of a drive
    that their names do not tell -> the axis, or any other name for the drive.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 3600.0 * hours + 0.5 * sampling, sampling)
    axes = {axis.position: name for name, axis in machine.axes.items()}
    work = {name: _jobs(rng, time) for name in [*machine.axes, *sorted({*together.values()} - {*machine.axes})]}
    columns = {"time [s]": time}
    for signal, entry in machine.signals.items():
        drive = axes.get(signal) or together.get(signal)
        drive = drive or next((a for a in machine.axes if signal.startswith(f"{a}_")), "")
        values = _column(rng, signal, entry, time, work.get(drive))
        columns[f"{entry.column or signal} [{entry.unit}]"] = values
    rows = np.column_stack(list(columns.values()))
    lines = [",".join(columns), *(",".join(f"{v:.6g}" for v in row) for row in rows)]
    facts = (
        f'sampling = "{sampling:g} s"\nprovenance = "drawn from a seed"\nsynthetic = ["loads"]\n'
        f'initial_temperature = "{START:g} degC"\n'
    )
    return LoadsOfRun(name, "\n".join(lines) + "\n", facts)


def _column(
    rng: np.random.Generator, signal: str, entry: SignalEntry, time: np.ndarray, work: np.ndarray | None
) -> np.ndarray:
    """(n,) one signal in its unit; work: share of an axis' top speed (n,), where it belongs to an axis."""
    low, high = (v if isinstance(v, float | int) else to_si(v, entry.unit) for v in entry.range)
    if entry.unit == "degC":
        return _air(rng, time)
    if work is None:
        level = _jobs(rng, time)
        return (level > 0.0).astype(float) * high if entry.unit == "1" else TOP * high * level
    if signal.endswith("_position"):
        return _position(rng, work, low, high)
    if signal.endswith(STRAINED):  # friction, acceleration, and what it cuts with; some at rest
        cutting = np.where(work > 0.0, 0.25 + 0.5 * work + 0.25 * rng.random(len(time)), 0.08)
        return np.asarray(TOP * high * cutting)
    return np.asarray(TOP * high * work)


def _jobs(rng: np.random.Generator, time: np.ndarray) -> np.ndarray:
    """(n,) levels 0.3 .. 1 from job to job, or rest."""
    edges = np.cumsum(rng.uniform(*BLOCK, size=int(time[-1] / BLOCK[0]) + 2))
    level = rng.uniform(0.3, 1.0, len(edges) + 1) * (rng.random(len(edges) + 1) > RESTS)
    level[:2] = np.maximum(level[:2], 0.5)  # a run begins with work
    return np.asarray(level[np.searchsorted(edges, time, side="right")])


def _position(rng: np.random.Generator, work: np.ndarray, low: float, high: float) -> np.ndarray:
    """(n,) strokes around the middle of a job while it works; at rest where it stopped."""
    found, middle, now = np.empty(len(work)), 0.0, 0.0
    for i, level in enumerate(work):
        if i == 0 or level != work[i - 1]:
            middle = rng.uniform(-0.4, 0.4)
        now = middle + rng.uniform(-0.5, 0.5) if level > 0.0 else now
        found[i] = 0.5 * (low + high) + 0.5 * (high - low) * now
    return found


def _air(rng: np.random.Generator, time: np.ndarray) -> np.ndarray:
    """(n,) degC: a swing of a day and one of a shift, from START on."""
    found = np.full(len(time), START)
    for hours, share in ((24.0, 1.0), (rng.uniform(3.0, 7.0), 0.4)):
        phase = rng.uniform(0.0, 2.0 * np.pi)
        size = share * rng.uniform(*SWING)
        found += size * (np.sin(2.0 * np.pi * time / (3600.0 * hours) + phase) - np.sin(phase))
    return found
