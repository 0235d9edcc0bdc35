"""Laws at the bounds of their signals: what a run would meet there is met here, before hours are spent.

Every loss and film is evaluated at all corners of the certified ranges of the signals it reads. What is no number, or a
film that draws heat out of the cold, is an error; more heat than a machine tool has power is a warning.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np

from twin.errors import Problem, TwinError
from twin.machine.description import Machine
from twin.machine.explain import Explanation, Load, explain, load_of
from twin.machine.wiring import signal

MUCH_HEAT = 1e5  # W of one source: spindles and drives of machine tools lose some kilowatts at most
MUCH_FILM = 1e5  # W/(m^2 K): boiling water has 1e4
MOST_SIGNALS = 6  # of a law, whose 64 corners are visited; no law has more than four


def beyond_at_bounds(machine: Machine) -> Iterator[Problem]:
    """Problems of the sources and films of a description that is sound otherwise."""
    at_top = load_of(machine, {})
    for section, entries in (("sources", machine.sources), ("films", machine.films)):
        for name in entries:
            load, names = _corners(machine, tuple(entries[name].signals.values()), at_top)
            with np.errstate(all="ignore"):  # what is no number is what is looked for
                try:
                    found = explain(machine, f"{section}.{name}", load)
                except TwinError:
                    continue  # reported with the law itself
            yield from _problems(found, load, names)


def _corners(machine: Machine, signals: tuple[str, ...], at_top: Load) -> tuple[Load, tuple[str, ...]]:
    """A load with one sample per corner of the ranges of these signals, all others at their upper bounds."""
    names = tuple(dict.fromkeys(signals))[:MOST_SIGNALS]
    ends = [(_low(machine, name, at_top), float(at_top.signals[name][0])) for name in names]
    visited = list(itertools.product(*ends))
    n = len(visited)
    corners = np.array(visited, dtype=float).reshape(n, len(names))
    values = {name: np.full(n, float(value[0])) for name, value in at_top.signals.items()}
    values |= {name: corners[:, k] for k, name in enumerate(names)}
    return Load(np.arange(float(n)), values, at_top.told, at_top.states), names


def _low(machine: Machine, name: str, at_top: Load) -> float:
    return signal(name, machine.signals[name]).low


def _problems(found: Explanation, load: Load, names: tuple[str, ...]) -> Iterator[Problem]:
    value = np.asarray(found.value, dtype=float)
    wrong = ~np.isfinite(value) | ((value < 0.0) if found.kind == "film" else np.zeros(len(value), dtype=bool))
    much = MUCH_HEAT if found.kind == "source" else MUCH_FILM
    where = f"machine.toml: {found.path}"
    remedy = f"check the parameters and the ranges of its signals: twin losses --explain {found.path}"
    if wrong.any():
        k = int(np.argmax(wrong))
        yield Problem(f"{_at(load, names, k)} the law '{found.law}' gives {value[k]:.4g} {found.unit}", where, remedy)
    elif np.abs(value).max() > much:
        k = int(np.argmax(np.abs(value)))
        what = f"{_at(load, names, k)} the law '{found.law}' gives {value[k]:.4g} {found.unit}, which is much"
        yield Problem(what, where, remedy, warning=True)


def _at(load: Load, names: tuple[str, ...], k: int) -> str:
    shown = ", ".join(f"{name} {load.signals[name][k]:.4g}" for name in names if math.isfinite(load.signals[name][k]))
    return f"at {shown}" if shown else "always,"
