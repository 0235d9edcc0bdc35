"""The course of the sun's heat: half a cosine of some length about an hour, the same every day."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.diagnose.diagnosis import Window
from twin.diagnose.study import Study

LEAST = 0.01  # of its top, from which an hour belongs to a bell


def level(t: np.ndarray, centre: float, length: float) -> np.ndarray:
    """Height (n,) at times t (n,) [s] after the start of a run; 1 at the top."""
    return np.asarray(np.cos(np.pi * np.clip((t - centre) / length, -0.5, 0.5)))


def by_blocks(
    study: Study, blocks: Sequence[tuple[int, int, int]], centre: float, length: float
) -> tuple[np.ndarray, tuple[Window, ...]]:
    """Levels (n_runs, n_blocks), a row per fitted run, and the windows of the blocks in the bell."""
    weights = np.zeros((len(study.fitted), len(blocks)))
    windows = []
    for b, (i, start, end) in enumerate(blocks):
        run = study.runs[study.fitted[i]].run
        dt = run.drive.time[1] - run.drive.time[0]
        weights[i, b] = float(level(np.array((start + end) / 2 * dt), centre, length))
        if weights[i, b] > LEAST:
            windows.append(Window(run.name, start * dt, end * dt, weights[i, b]))
    return weights, tuple(windows)


def name(centre: float, length: float) -> str:
    return f"{max(centre - length / 2, 0.0) / 3600:.0f} to {(centre + length / 2) / 3600:.0f} h of every run"
