"""Random load scenarios: what a machine may meet, drawn inside the certified box.

Training (compression) and held-out (certificate) scenarios come from the same distribution with different seeds, so
that the maximum error over N held-out ones is exceeded by a new one with probability <= 1/(N + 1).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.rom.drive import Drive, evaluate
from twin.rom.following import DIFFERENCES, Following
from twin.rom.load_model import Film, Joint, LoadModel

LOADS = ("blocks", "step", "cool-down", "ramp", "duty")
FILMS = ("laws", "low", "high", "random")
AMBIENTS = ("constant", "step", "ramp", "daily")


@dataclass(frozen=True)
class Scenario:
    """A drawn scenario with the label that reports name it by."""

    label: str  # "seed 3: blocks, films high, ambient ramp"
    drive: Drive
    start: float  # degC, uniform initial temperature


def draw(
    load: LoadModel, seed: int, hours: float = 4.0, dt: float = 60.0, still: bool = False, air_apart: bool = False
) -> Scenario:
    """One scenario of `hours` at steps `dt` [s]: axes hold or sweep, loads follow one pattern, films and air another.

    still: all axes stay in the middle of their strokes (to show what a basis trained at one pose is worth). air_apart:
    every environment has a course of its own; else all share one with small deviations, as the zones of a hall.
    """
    rng = np.random.default_rng([seed, 20231])
    pattern, film, ambient = rng.choice(LOADS), rng.choice(FILMS), rng.choice(AMBIENTS)
    sampling = dt / 6
    n = round(hours * 3600 / sampling)
    time = np.arange(n + 1) * sampling
    signals = {}
    positions = {axis.position: axis for axis in load.axes}
    air = [e.signal for e in load.environments if e.signal]
    centre = None
    for signal in load.signals:
        if signal.name in positions:
            axis = positions[signal.name]
            moved = _position(rng, time, axis.low, axis.high)
            signals[signal.name] = np.full_like(time, (axis.low + axis.high) / 2) if still else moved
        elif signal.name in air and air_apart:
            signals[signal.name] = _ambient(rng, time, signal.low, signal.high, ambient)
        elif signal.name in air:
            centre = centre if centre is not None else _ambient(rng, time, signal.low, signal.high, ambient)
            signals[signal.name] = np.clip(centre + rng.uniform(-0.5, 0.5), signal.low, signal.high)
        else:
            signals[signal.name] = _load(rng, time, signal.low, signal.high, pattern)
    drive = evaluate(load if film == "laws" else replace(load, films=()), time, signals, dt)
    if film != "laws":  # whole coefficients anywhere in the box, radiation included: the laws need no tables
        n = drive.n_steps
        drive = replace(
            drive, theta=_films(rng, load, n, film, dt), films=Following.none(n, DIFFERENCES), radiation=False
        )
    start = float(signals[air[0]][0]) if air else load.environments[0].temperature
    return Scenario(f"seed {seed}: {pattern}, films {film}, ambient {ambient}", drive, start)


def _blocks(rng: np.random.Generator, time: np.ndarray, shortest: float, longest: float) -> np.ndarray:
    """Index of the block each time belongs to; block lengths log-uniform [s]."""
    edges = [0.0]
    while edges[-1] <= time[-1]:
        edges.append(edges[-1] + shortest * (longest / shortest) ** rng.random())
    return np.searchsorted(np.array(edges), time, side="right") - 1


def _position(rng: np.random.Generator, time: np.ndarray, low: float, high: float) -> np.ndarray:
    block = _blocks(rng, time, 300.0, 5400.0)
    position = np.empty_like(time)
    for b in range(block[-1] + 1):
        here = block == b
        a, z = np.sort(rng.uniform(low, high, 2))
        if rng.random() < 0.5:
            position[here] = a
        else:  # sweep a .. z .. a
            speed = rng.uniform(0.02, 0.6)
            phase = (time[here] * speed / max(z - a, 1e-6) + rng.random()) % 2.0
            position[here] = a + (z - a) * (1.0 - np.abs(1.0 - phase))
    return position


def _load(rng: np.random.Generator, time: np.ndarray, low: float, high: float, pattern: str) -> np.ndarray:
    """A load channel; each is off in a third of the scenarios' blocks, so that sources act one by one too."""
    idle = min(max(0.0, low), high)
    if pattern == "step":
        return np.full_like(time, rng.uniform(low, high))
    if pattern == "cool-down":
        return np.where(time < rng.uniform(0.2, 0.6) * time[-1], rng.uniform(low, high), idle)
    if pattern == "ramp":
        return np.interp(time, [0, time[-1]], rng.uniform(low, high, 2))
    block = _blocks(rng, time, 300.0, 7200.0) if pattern == "blocks" else _blocks(rng, time, 60.0, 600.0)
    level = rng.uniform(low, high, block[-1] + 1)
    level[rng.random(len(level)) < 1 / 3] = idle
    return level[block]


def _ambient(rng: np.random.Generator, time: np.ndarray, low: float, high: float, pattern: str) -> np.ndarray:
    a, b = rng.uniform(low, high, 2)
    if pattern == "constant":
        return np.full_like(time, a)
    if pattern == "step":
        return np.where(time < rng.uniform(0.1, 0.7) * time[-1], a, b)
    if pattern == "ramp":
        return np.interp(time, [0, time[-1]], [a, b])
    return (a + b) / 2 + (a - b) / 2 * np.sin(2 * np.pi * (time / 86400.0 + rng.random()))


def _films(rng: np.random.Generator, load: LoadModel, n_steps: int, pattern: str, dt: float) -> np.ndarray:
    low, high = theta_bounds(load)
    if pattern == "low":
        return np.tile(low, (n_steps, 1))
    if pattern == "high":
        return np.tile(high, (n_steps, 1))
    # every hour or so all coefficients move anywhere in the box (one factorisation of the full model each time)
    block = _blocks(rng, np.arange(n_steps) * dt, 2400.0, 7200.0)
    values = low * (high / low) ** rng.random((block[-1] + 1, len(low)))
    return values[block]


def theta_bounds(load: LoadModel) -> tuple[np.ndarray, np.ndarray]:
    """Certified bounds (n_theta,) of the affine coefficients [W/(m^2 K)]."""
    terms: tuple[Film | Joint, ...] = (*load.films, *load.joints)
    return np.array([t.low for t in terms]), np.array([t.high for t in terms])
