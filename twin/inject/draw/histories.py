"""Histories of what is hidden: windows drawn inside the runs, and powers of logged signals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from twin.inject.experiment import HOUR, RUNS, STEP, STEPS, Experiment
from twin.machine.effects.effect import Window


def one_of(rng: np.random.Generator, names: Iterable[str]) -> str:
    known = list(names)
    return known[rng.integers(len(known))]


def gate(windows: Sequence[Window], run: str) -> np.ndarray:
    """(STEPS,) the levels of the windows of a run, by its name."""
    edges = STEP * np.arange(STEPS + 1)
    level = np.zeros(STEPS)
    for w in windows:
        if w.run == run:
            level += w.level * np.clip(np.minimum(edges[1:], w.end) - np.maximum(edges[:-1], w.start), 0.0, STEP) / STEP
    return level


def signal(experiment: Experiment, r: int, name: str) -> np.ndarray:
    """|signal| (STEPS,) [SI] of a run, as logged."""
    return np.abs(experiment.runs[r].loads.columns[name][:STEPS])


def windows_of(rng: np.random.Generator, hours: float, fitted: int | None = None) -> tuple[Window, ...]:
    """A window of some hours in one fitted run and one in the sealed run, on whole steps inside of them."""
    first = int(rng.integers(2)) if fitted is None else fitted
    found = []
    for r in (first, 2):
        start = STEP * round(rng.uniform(0.5 * HOUR, 11.5 * HOUR - hours * HOUR) / STEP)
        found.append(Window(RUNS[r], start, start + hours * HOUR))
    return tuple(found)


def on(windows: tuple[Window, ...]) -> list[np.ndarray]:
    return [gate(windows, run) for run in RUNS]


def followed(experiment: Experiment, name: str, exponent: float) -> tuple[list[np.ndarray], float, float]:
    """A history per run, its reference [SI] (the largest value while fitting), and its mean there while it works."""
    top = max(float(signal(experiment, r, name).max()) for r in (0, 1))
    histories = [(signal(experiment, r, name) / top) ** exponent for r in range(3)]
    fitted = np.concatenate(histories[:2])
    return histories, top, float(fitted[fitted > 0.01].mean())


def telegraph(rng: np.random.Generator, time: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """(n,) levels between -1 and 1 at times (n,) s, drawn anew every 1.7 h in the mean, 0.4 h at least; from one to
    another by ramps of 0.7 h per unit. steps: (n,) s, by which the ramp goes on before each time."""
    edges = np.cumsum(rng.exponential(1.3 * HOUR, 40) + 0.4 * HOUR)
    target = rng.choice([-1.0, -0.4, 0.0, 0.6, 1.0], 41)[np.searchsorted(edges, time)]
    ramp, now = np.empty(len(time)), 0.0
    for k, most in enumerate(steps / (0.7 * HOUR)):
        now += float(np.clip(target[k] - now, -most, most))
        ramp[k] = now
    return ramp
