"""A load signal is declared wrongly by an exact factor, or the clock of a run is off."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.faults.context import Singly
from twin.diagnose.faults.fault import Described, Family, Fault
from twin.diagnose.faults.readings import late
from twin.diagnose.model.study import Study
from twin.diagnose.result.diagnosis import Cause
from twin.diagnose.result.spot import Of, Spot


@dataclass(frozen=True)
class Factor(Fault):
    """All that reads the signal, times an exact factor; its place is signal*factor."""

    def factor(self, name: str) -> tuple[str, float]:
        spot = Spot.read(name)
        return spot.owner, float(spot.partner)

    def described(self, study: Study, d: Described, a: np.ndarray, covariance: np.ndarray) -> Described:
        place, factor = self.factor(d.place)
        return replace(d, place=place, size=(factor, factor, factor))


@dataclass(frozen=True)
class Clock(Fault):
    """A run's clock."""

    def change(self, study: Study, states: Callable[[int], np.ndarray], name: str, size: float) -> np.ndarray:
        own = [k for k in study.fitted if study.runs[k].run.name == self.bare(name)]
        return size * late(study, {k: states(k) for k in own}, size)


SIGNAL = Factor("signal", "signal", "1", "signals.", 1, 0.0, fixed=True, corrects=True, called="factor")
CLOCK = Clock(
    "signal", "clock", "s", "runs.", 0, 30.0, read=True, called="clock",
    sizes=(-3600.0, -1200.0, -400.0, 400.0, 1200.0, 3600.0),
    largest=43200.0,  # s: half a day
)  # fmt: skip
FAULTS = (SIGNAL, CLOCK)


def editable(cause: Cause) -> bool:
    """A factor, and no clock."""
    return Spot.read(cause.place).of is Of.SIGNAL


FAMILY = Family(
    10, "signal", "Load signal at fault",
    "Declared otherwise than logged: peak logged as rms, line as phase current, 1/s as 1/min, or a clock that is off.",
    "u_k times an exact factor;  y(t - a)", "an exact factor in everything that reads the signal; a shift of all",
    "an exact factor; 0.5 min", "-",
    "currents by 2, sqrt 2, sqrt 3, powers by 2, sqrt 3, speeds by 2, 60; the clock of every run",
    "signal", Singly(FAULTS), what="load signal at fault", channel=True, kind_told=True,
    editable=editable,
)  # fmt: skip
