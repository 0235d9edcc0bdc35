"""Which temperature sensor drifts: measured minus simulated, each against the others.

A model that is wrong, or a machine in a draught, moves many residuals together; a sensor that comes loose moves one.
Residuals are averaged over TAU and taken relative to what they were in the first hours; what one is apart from the
median of all is told of that sensor alone. The light half of `twin diagnose`, which weighs machine causes too.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field

TAU = 1800.0  # s: longer than the filling of a coolant tank or an open door, shorter than a shift
LEARN = 2 * 3600.0  # s in which residuals are taken as what the model is off by anyway
APART = 1.5  # K from the median of all: what `twin check` refutes a channel by
FEWEST = 3  # sensors, below which none can be told from the machine


def median(values: Iterable[float]) -> float:
    """Of one value at least. (The statistics module takes longer to load than all of this package.)"""
    ordered = sorted(values)
    n = len(ordered)
    return 0.5 * (ordered[(n - 1) // 2] + ordered[n // 2])


@dataclass
class Residual:
    """Of one sensor; plain numbers."""

    mean: float = 0.0  # K, exponentially weighted over TAU
    first: float = 0.0  # K, mean over LEARN
    seconds: float = 0.0  # of readings
    last: float = math.nan  # K
    before: float = math.nan  # K, the reading before: the median of three is taken, which no single spike moves
    earlier: float = math.nan  # K


@dataclass
class Drift:
    """Residuals of all sensors that are measured."""

    of: dict[str, Residual] = field(default_factory=dict)

    def take(self, measured: Mapping[str, float], simulated: Mapping[str, float], step: float) -> None:
        """Readings [degC] at the end of a step of so many seconds; those that are not finite are left out."""
        for name, value in measured.items():
            if name not in simulated or not math.isfinite(value):
                continue
            r = self.of.setdefault(name, Residual())
            r.earlier, r.before, r.last = r.before, r.last, value - simulated[name]
            if not math.isfinite(r.earlier):
                continue
            now = median((r.earlier, r.before, r.last))
            r.seconds += step
            share = step / min(r.seconds, TAU) if r.seconds < TAU else 1.0 - math.exp(-step / TAU)
            r.mean += share * (now - r.mean)
            if r.seconds <= LEARN:
                r.first += step / r.seconds * (now - r.first)

    def alarms(self) -> list[str]:
        """In words, one for each sensor that drifts apart from the others."""
        moved = {name: r.mean - r.first for name, r in self.of.items() if r.seconds > LEARN}
        if len(moved) < FEWEST:
            return []
        most = median(moved.values())  # of all: of three, one that drifts does not shift it
        return [
            f"sensor {name} reads {change - most:+.1f} K against the model and the other sensors since its first "
            f"{LEARN / 3600:g} h: it drifts, or sits loose"
            for name, change in moved.items()
            if abs(change - most) > APART
        ]

    def stored(self) -> dict[str, dict]:
        return {name: asdict(r) for name, r in self.of.items()}

    def restore(self, told: Mapping[str, dict]) -> None:
        self.of = {name: Residual(**r) for name, r in told.items()}
