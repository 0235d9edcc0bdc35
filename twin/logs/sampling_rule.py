"""How often loads must be sampled: Table 16.1 of paper 001, and what averaging costs.

A tenth of the time in which a quantity can cross its range: current follows acceleration, so a_max / j_max; speed
v_max / a_max; position the time to pass one segment of a rail. The paper calls this Nyquist; it is a factor ten, a rule
of practice (erratum E-001-6). A slower log loses which segment a load belongs to, not the heat, where it holds means
of powers (`twin.logs.compress`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

RULE = 10.0  # samples per crossing


@dataclass(frozen=True)
class AxisLimits:
    """Limits of one drive; None where unknown."""

    name: str
    speed: float | None = None  # m/s
    acceleration: float | None = None  # m/s^2
    jerk: float | None = None  # m/s^3
    segment: float | None = None  # m: the shortest segment of the axis' rails and screws


@dataclass(frozen=True)
class Needed:
    """The sampling interval that one quantity of one axis asks for."""

    interval: float  # s
    axis: str
    quantity: str  # "current", "speed" or "position"

    def __str__(self) -> str:
        return f"{self.interval * 1e3:.3g} ms ({self.quantity} of axis '{self.axis}')"


def needed(limits: AxisLimits) -> tuple[Needed, ...]:
    """Table 16.1 for one axis: T_I = a/(10 j), T_v = v/(10 a), T_x = L_E/(10 v) [s]; unknown ones are left out."""
    crossings = (
        ("current", limits.acceleration, limits.jerk),
        ("speed", limits.speed, limits.acceleration),
        ("position", limits.segment, limits.speed),
    )
    return tuple(Needed(way / (RULE * rate), limits.name, what) for what, way, rate in crossings if way and rate)


def core_sampling(axes: Sequence[AxisLimits]) -> Needed | None:
    """T_core: the shortest over all quantities and axes. None where no limits are known."""
    return min((n for axis in axes for n in needed(axis)), key=lambda n: n.interval, default=None)


def averaging_gain(frequency: float, interval: float) -> float:
    """Amplitude 1 of a sine of `frequency` [Hz] after averaging over `interval` [s].

    sin(x)/x with x = pi f T. Over a tenth of a time constant tau, 0.99958 at the corner frequency 1/(2 pi tau) and
    0.959 at ten times that: averages over tau/10 serve as well as samples (paper 001, Fig. 16.6).
    """
    x = math.pi * frequency * interval
    return math.sin(x) / x if x else 1.0


def averaging_delay(interval: float) -> float:
    """How late [s] an average over `interval` [s] is, given at the end of the interval."""
    return interval / 2.0
