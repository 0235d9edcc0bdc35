"""Tables of the laws that follow a temperature of the model, step by step (`twin.rom.following`)."""

from __future__ import annotations

import numpy as np

from twin.physics.laws import LAWS
from twin.rom.following import DIFFERENCES, TEMPERATURES, Following
from twin.rom.law_values import law_table, states_of
from twin.rom.load_model import LawUse, LoadModel
from twin.rom.sampling import Intervals

_SAMPLES_AT_ONCE = 8192  # bounds the memory of logs at 100 Hz


def following_films(
    load_model: LoadModel, values: dict[str, np.ndarray], environments: np.ndarray, intervals: Intervals
) -> Following:
    """Films over DIFFERENCES; values (n_samples,) by signal, environments (n_samples, n_environments) [degC]."""
    index, tables = [], []
    for k, film in enumerate(load_model.films):
        if free := states_of(film.use):
            air = environments[:, film.environment]
            states = {"surface": air[:, None] + DIFFERENCES, "ambient": air[:, None]}
            index.append(k)
            tables.append(_tabulate(film.use, film.gain, values, {name: states[name] for name in free}, intervals))
    return _stack(index, tables, DIFFERENCES, intervals.n_steps)


def following_losses(load_model: LoadModel, values: dict[str, np.ndarray], intervals: Intervals) -> Following:
    """Sources over TEMPERATURES."""
    index, tables = [], []
    for k, source in enumerate(load_model.sources):
        if free := states_of(source.use):
            index.append(k)
            states = dict.fromkeys(free, TEMPERATURES[None, :])
            tables.append(_tabulate(source.use, source.gain, values, states, intervals))
    return _stack(index, tables, TEMPERATURES, intervals.n_steps)


def _tabulate(
    use: LawUse, gain: float, values: dict[str, np.ndarray], states: dict[str, np.ndarray], intervals: Intervals
) -> tuple[np.ndarray, np.ndarray]:
    """Step means (n_steps, m) of gain times a law over a grid of its states, and where it is outside its validity."""
    if not use.signals:  # nothing nonlinear varies within a step: the mean state will do
        means = {name: s if len(s) == 1 else intervals.mean(s) for name, s in states.items()}
        n = intervals.n_steps
        held = law_table(use, {}, n, means, holds=True) if LAWS[use.law].validity else True
        value = gain * law_table(use, {}, n, means)
        return value, np.broadcast_to(np.logical_not(held), value.shape)
    mean, outside = [], []
    begin = 0
    last = np.append(intervals.first[1:], len(intervals.start)) - 1  # last interval of each step
    while begin < intervals.n_steps:
        first_sample = intervals.sample[intervals.first[begin]]
        end = int(np.searchsorted(intervals.sample[last], first_sample + _SAMPLES_AT_ONCE, side="right"))
        end = min(max(end, begin + 1), intervals.n_steps)
        part = intervals.part(begin, end)
        here = slice(first_sample, intervals.sample[last[end - 1]] + 1)
        signals = {name: values[name][here] for name in use.signals.values()}
        grid = {name: s if len(s) == 1 else s[here] for name, s in states.items()}
        count = here.stop - here.start
        value = gain * law_table(use, signals, count, grid)
        mean.append(part.mean(value))
        if LAWS[use.law].validity:
            outside.append(part.any(~law_table(use, signals, count, grid, holds=True)[part.sample]))
        else:
            outside.append(np.zeros(mean[-1].shape, dtype=bool))
        begin = end
    return np.concatenate(mean), np.concatenate(outside)


def _stack(index: list[int], tables: list[tuple[np.ndarray, np.ndarray]], grid: np.ndarray, n: int) -> Following:
    if not index:
        return Following.none(n, grid)
    value, outside = (np.stack(part, axis=1) for part in zip(*tables, strict=True))
    return Following(tuple(index), grid, value, outside)
