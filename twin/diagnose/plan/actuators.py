"""What a control can command, seen from a log: load signals that one motor makes together.

An experiment sets one level per motor; its other signals must follow as they do on the machine, or its heat is that of
no machine. Which belong together is taken from the description first (a law that reads two signals, a contact that an
axis moves), then from names ("x_motor_speed" of axis x), then from the runs (signals that go on and off together). Runs
alone were rejected: axes that always moved together would be one, and what moves them apart is the best experiment.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from twin.rom.load_model import LoadModel, Signal

ON = 0.05  # of its largest value, from which a signal is on: as the pictures of the residuals have it
ALIKE = 0.95  # of all steps in which signals of one motor are on or off together
RARE = 0.02  # share of steps that a signal must be on, and off, for its steps to tell anything
LEADERS = ("m/s", "1/s", "A", "W", "1")  # units, the one that is commanded first
SPEEDS = ("m/s", "1/s")  # which are proportional to each other at one motor
KNOTS = (0.0, 0.25, 0.5, 0.75, 1.0)  # of the leader's largest value, at which the others are read off the runs


@dataclass(frozen=True)
class Actuator:
    """Signals of one motor: its leader is commanded, the others follow."""

    name: str  # of its axis, else of its leader
    axis: int | None  # in LoadModel.axes
    leader: str
    top: float  # largest level in its declared range [SI]
    knots: np.ndarray  # (k,) levels of the leader [SI]
    followers: Mapping[str, np.ndarray]  # (k,) values at these levels [SI]

    def at(self, level: np.ndarray) -> dict[str, np.ndarray]:
        """All signals (n,) [SI] at levels (n,) of the leader [SI]."""
        return {
            self.leader: level,
            **{name: np.interp(level, self.knots, values) for name, values in self.followers.items()},
        }


def actuators_of(load: LoadModel, seen: Sequence[Mapping[str, np.ndarray]]) -> tuple[Actuator, ...]:
    """The actuators whose heat a machine has; seen: per run the signals (n,) [SI] of its steps."""
    signals = {s.name: s for s in load.signals}
    heating = _heating(load)
    values = {
        name: np.abs(np.concatenate([run[name] for run in seen if name in run] or [np.zeros(0)])) for name in heating
    }
    groups = _united(load, _structural(load, heating), values)
    result = []
    for axis, names in groups:
        leader = min(names, key=lambda n: (LEADERS.index(signals[n].unit), names.index(n)))
        top = _top(signals[leader])
        if top > 0.0:
            name = leader if axis is None else load.axes[axis].name
            knots, followers = _followers(signals, leader, [n for n in names if n != leader], values, top)
            result.append(Actuator(name, axis, leader, top, knots, followers))
    return tuple(result)


def _heating(load: LoadModel) -> list[str]:
    """Signals that sources read and nobody else sets: no positions, no air, no switches of doors."""
    given = (
        {a.position for a in load.axes} | {e.signal for e in load.environments} | {e.switch for e in load.environments}
    )
    given |= {j.switch for j in load.joints} | {p.switch for p in load.pairs}
    read = {s for source in load.sources for s in source.use.signals.values()}
    return [s.name for s in load.signals if s.name in read - given and s.unit in LEADERS]


def _structural(load: LoadModel, heating: Sequence[str]) -> list[tuple[int | None, list[str]]]:
    """Groups (axis, signals) that the description joins, single signals among them."""
    moved_by = {pair.contact: pair.axis for pair in load.pairs}
    groups: list[tuple[int | None, list[str]]] = [(None, [name]) for name in heating]
    for source in load.sources:
        read = [s for s in source.use.signals.values() if s in heating]
        own = [g for g in groups if set(g[1]) & set(read)]
        axes = [a for a in (moved_by.get(source.contact), *(axis for axis, _ in own)) if a is not None]
        if own:
            joined = (axes[0] if axes else None, [n for _, names in own for n in names])
            groups = [joined if g is own[0] else g for g in groups if g is own[0] or g not in own[1:]]
    return groups


def _united(
    load: LoadModel, groups: Sequence[tuple[int | None, list[str]]], values: Mapping[str, np.ndarray]
) -> list[tuple[int | None, list[str]]]:
    """Groups as one that bear the name of an axis, or else go on and off together: but no two axes."""
    result: list[tuple[int | None, list[str]]] = []
    for axis, names in sorted(groups, key=lambda g: g[0] is None):
        called = [
            k for k, (other, _) in enumerate(result)
            if other is not None and all(n.startswith(f"{load.axes[other].name}_") for n in names)
        ]  # fmt: skip
        alike = [
            k
            for k, (_, known) in enumerate(result)
            if any(_together(values[a], values[b]) for a in names for b in known)
        ]
        own = next((k for k in (*called, *alike) if axis is None or result[k][0] in (None, axis)), None)
        if own is None:
            result.append((axis, list(names)))
        else:
            result[own] = (result[own][0], [*result[own][1], *names])
    return result


def _together(a: np.ndarray, b: np.ndarray) -> bool:
    if len(a) != len(b) or not len(a) or not a.max() or not b.max():
        return False
    on = [v > ON * v.max() for v in (a, b)]
    tells = all(RARE < m.mean() < 1.0 - RARE for m in on)
    return bool(tells and np.mean(on[0] == on[1]) > ALIKE)


def _top(signal: Signal) -> float:
    return float(max(abs(signal.low), abs(signal.high)))


def _followers(
    signals: Mapping[str, Signal], leader: str, names: Sequence[str], values: Mapping[str, np.ndarray], top: float
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Levels of the leader (k,), and per follower its values (k,) there: as in the runs, else the same share of its
    range; speeds in proportion."""
    lead = values[leader]
    largest = float(lead.max(initial=0.0))
    ran = largest > ON * ON * top
    seen = np.array(KNOTS) * (largest if ran else top)
    knots = np.unique(np.append(seen, top))
    followers = {}
    for name in names:
        own, limit = values[name], _top(signals[name])
        at_all = ran and len(own) == len(lead)
        if signals[name].unit in SPEEDS and signals[leader].unit in SPEEDS:
            ratio = float(own @ lead / (lead @ lead)) if at_all and own.any() else limit / top
            followers[name] = np.minimum(ratio * knots, limit)
        elif at_all:
            nearest = np.argmin(np.abs(lead[:, None] - seen), axis=1)
            known = [k for k in range(len(seen)) if (nearest == k).any()]
            means = [float(own[nearest == k].mean()) for k in known]
            followers[name] = np.interp(knots, seen[known], means)
        else:
            followers[name] = limit * knots / top
    return knots, followers
