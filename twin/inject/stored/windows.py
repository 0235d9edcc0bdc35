"""Windows of stored trials: stretches of hours, a bell, a sign that turns at random."""

from __future__ import annotations

import math

import numpy as np

from twin.inject.experiment import HOUR, RUNS
from twin.machine.effects.effect import Window

END = 13.0 * HOUR  # s: after the last row of every run


def hours(run: str, *stretches: tuple[float, float]) -> tuple[Window, ...]:
    return tuple(Window(run, a * HOUR, b * HOUR) for a, b in stretches)


def bell(run: str, start: float, end: float, level: float) -> tuple[Window, ...]:
    """A sine squared between two hours, in steps of 10 min."""
    edges = np.arange(start, end + 1e-9, 1.0 / 6.0)
    height = level * np.sin(math.pi * (edges + 1.0 / 12.0 - start) / (end - start)) ** 2
    return tuple(
        Window(run, a * HOUR, b * HOUR, float(h)) for a, b, h in zip(edges[:-1], edges[1:], height[:-1], strict=True)
    )


def telegraph(seed: int) -> tuple[tuple[Window, ...], tuple[Window, ...]]:
    """Stretches of one and of the other sign: it turns at random, every 50 min in the mean."""
    rng = np.random.default_rng(seed)
    signs: tuple[list[Window], list[Window]] = ([], [])
    for run in RUNS:
        at, which = 0.0, int(rng.integers(2))
        while at < END:
            until = min(at + rng.exponential(50.0 * 60.0), END)
            signs[which].append(Window(run, at, until))
            at, which = until, 1 - which
    return tuple(signs[0]), tuple(signs[1])
