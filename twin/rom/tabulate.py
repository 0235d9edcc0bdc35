"""Tables of the laws that follow a temperature of the model, step by step (`twin.rom.following`)."""

from __future__ import annotations

import numpy as np

from twin.rom.following import DIFFERENCES, TEMPERATURES, Following
from twin.rom.law_values import law_table, states_of
from twin.rom.load_model import LawUse, LoadModel
from twin.rom.sampling import Intervals

_SAMPLES_AT_ONCE = 8192  # bounds the memory of logs at 100 Hz
_NOWHERE = np.zeros((1, 1), dtype=bool)


def following_films(
    load_model: LoadModel, values: dict[str, np.ndarray], environments: np.ndarray, intervals: Intervals
) -> Following:
    """Films over DIFFERENCES; values (n_samples,) by signal, environments (n_samples, n_environments) [degC]."""
    uses = {k: film.use for k, film in enumerate(load_model.films) if states_of(film.use)}
    tables = [
        _tabulate(use, load_model.films[k].gain, values, environments[:, load_model.films[k].environment], intervals)
        for k, use in uses.items()
    ]
    return _stack(tuple(uses), tables, DIFFERENCES, intervals.n_steps)


def following_losses(load_model: LoadModel, values: dict[str, np.ndarray], intervals: Intervals) -> Following:
    """Sources over TEMPERATURES."""
    uses = {k: source.use for k, source in enumerate(load_model.sources) if states_of(source.use)}
    tables = [_tabulate(use, load_model.sources[k].gain, values, None, intervals) for k, use in uses.items()]
    return _stack(tuple(uses), tables, TEMPERATURES, intervals.n_steps)


def _states(use: LawUse, air: np.ndarray | None) -> dict[str, np.ndarray]:
    """The states of a law that no signal is wired to, on their grid: (n, m), (n, 1) or (1, m) [degC]."""
    if air is None:
        return dict.fromkeys(states_of(use), TEMPERATURES[None, :])
    grid = {"surface": air[:, None] + DIFFERENCES, "ambient": air[:, None]}
    return {name: grid[name] for name in states_of(use)}


def _tabulate(
    use: LawUse, gain: float, values: dict[str, np.ndarray], air: np.ndarray | None, intervals: Intervals
) -> tuple[np.ndarray, np.ndarray]:
    """Step means (n_steps, m) of gain times a law over the grid of its state, and where it is outside its validity.

    air (n_samples,) [degC] of a film, None for a loss.
    """
    m = len(TEMPERATURES if air is None else DIFFERENCES)
    if not use.signals:  # nothing nonlinear varies within a step: the mean state will do
        n = intervals.n_steps
        states = _states(use, None if air is None else intervals.mean(air))
        value, holds = law_table(use, {}, n, states)
        outside = _NOWHERE if holds is None else ~holds
        return np.broadcast_to(gain * value, (n, m)), np.broadcast_to(outside, (n, m))
    parts = []
    begin = 0
    last = np.append(intervals.first[1:], len(intervals.start)) - 1  # last interval of each step
    while begin < intervals.n_steps:
        first_sample = intervals.sample[intervals.first[begin]]
        end = int(np.searchsorted(intervals.sample[last], first_sample + _SAMPLES_AT_ONCE, side="right"))
        end = min(max(end, begin + 1), intervals.n_steps)
        part = intervals.part(begin, end)
        here = slice(first_sample, intervals.sample[last[end - 1]] + 1)
        read = np.stack([*(values[name][here] for name in use.signals.values()), *([] if air is None else [air[here]])])
        new = np.append(True, (np.diff(read) != 0.0).any(axis=0))  # of samples that hold what was before, one is enough
        part, count = part.merged(np.cumsum(new) - 1), int(new.sum())
        signals = {name: values[name][here][new] for name in use.signals.values()}
        states = _states(use, None if air is None else air[here][new])
        value, holds = law_table(use, signals, count, states)
        mean = part.mean(gain * value)
        outside = _NOWHERE if holds is None else part.any(~holds[part.sample])
        # a law whose surface is measured has one value for the whole grid
        parts.append((np.broadcast_to(mean, (len(mean), m)), np.broadcast_to(outside, (len(mean), m))))
        begin = end
    value, beyond = (np.concatenate(p) for p in zip(*parts, strict=True))
    return value, beyond


def _stack(index: tuple[int, ...], tables: list[tuple[np.ndarray, np.ndarray]], grid: np.ndarray, n: int) -> Following:
    if not index:
        return Following.none(n, grid)
    value, outside = (np.stack(part, axis=1) for part in zip(*tables, strict=True))
    return Following(index, grid, value, outside)
