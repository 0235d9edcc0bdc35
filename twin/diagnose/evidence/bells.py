"""The course of the sun's heat: half a cosine of some length, about an hour of its own in every run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.machine.effects.effect import Window

LEAST = 0.01  # of its top, from which an hour belongs to a bell


@dataclass(frozen=True)
class Bell:
    """Of the fitted runs: runs may start at other hours of the day."""

    centres: tuple[float, ...]  # s after the start of each
    length: float  # s

    @property
    def middle(self) -> float:
        """Where it is expected in other runs [s]."""
        return float(np.mean(self.centres))

    def level(self, t: np.ndarray, run: int) -> np.ndarray:
        """Height (n,) at times t (n,) [s] after the start of a fitted run; 1 at the top."""
        return level(t, self.centres[run], self.length)


def level(t: np.ndarray, centre: float, length: float) -> np.ndarray:
    """Height (n,) at times t (n,) [s]; 1 at the top."""
    return np.asarray(np.cos(np.pi * np.clip((t - centre) / length, -0.5, 0.5)))


def by_blocks(
    runs: Sequence[tuple[str, float]], blocks: Sequence[tuple[int, int, int]], bell: Bell
) -> tuple[np.ndarray, tuple[Window, ...]]:
    """Levels (n_runs, n_blocks), a row per fitted run, and the windows of the blocks in the bell.

    runs: name and step [s] of each fitted run; blocks: as `elements.Histories.blocks`.
    """
    weights = np.zeros((len(runs), len(blocks)))
    windows = []
    for b, (i, start, end) in enumerate(blocks):
        name, dt = runs[i]
        weights[i, b] = float(bell.level(np.array((start + end) / 2 * dt), i))
        if weights[i, b] > LEAST:
            windows.append(Window(name, start * dt, end * dt, weights[i, b]))
    return weights, tuple(windows)


def name(bell: Bell, runs: Sequence[tuple[str, float]]) -> str:
    """In words."""
    spans = [
        f"{max(c - bell.length / 2, 0.0) / 3600:.0f} to {(c + bell.length / 2) / 3600:.0f} h" for c in bell.centres
    ]
    if len(set(bell.centres)) == 1:
        return f"{spans[0]} of every run"
    return "from " + " and ".join(f"{span} of {run}" for span, (run, _) in zip(spans, runs, strict=True))
