"""The experiment that effects are hidden in: a described machine, the loads of its runs, and how it is measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from twin.logs.read import read_run
from twin.logs.run import Run
from twin.machine.description import Machine
from twin.machine.load import load_machine

RUNS = ("diagnosis_1", "diagnosis_2", "diagnosis_sealed")  # the last is kept for judging
STEP, STEPS, SUBSTEPS = 60.0, 720, 1  # s, of a run, of a step
HOUR = 3600.0  # s
START = 22.0  # degC, of every run
MEASURED_EVERY, PLACES, APART = 1800.0, 3, 60.0  # s, places of the TCP one after the other, s between them
NOISE, TCP_NOISE = 0.08, 1e-6  # K, m, standard deviations


@dataclass(frozen=True)
class Experiment:
    """A machine as its description says it, and the runs in which effects are looked for."""

    folder: Path  # of the machine: machine.toml, runs/diagnosis_1, ...

    @cached_property
    def text(self) -> str:
        return (self.folder / "machine.toml").read_text(encoding="utf-8")

    @cached_property
    def machine(self) -> Machine:
        return load_machine(self.folder / "machine.toml")

    @cached_property
    def runs(self) -> tuple[Run, ...]:
        """The loads as logged, in the order of RUNS."""
        return tuple(read_run(self.folder / "runs" / name) for name in RUNS)

    def run(self, name: str) -> Run:
        """The loads of one of RUNS."""
        return self.runs[RUNS.index(name)]

    def another(self, text: str) -> Machine:
        """The machine of another text in the same folder."""
        return load_machine(self.folder / "machine.toml", text)


def plan(run: Run, axes: Sequence[str] = ("x", "y", "z")) -> tuple[np.ndarray, np.ndarray]:
    """Times (m,) [s] and positions (m, axes) [m] at which the TCP is measured: where the log has the axes then."""
    t = run.loads.time
    every = np.arange(MEASURED_EVERY, t[-1] + 1.0, MEASURED_EVERY)
    when = (every[:, None] - APART * np.arange(PLACES)[::-1]).ravel()
    return when, np.column_stack([np.interp(when, t, run.loads.columns[f"{a}_position"]) for a in axes])
