"""What a value of a load signal cannot be: not finite, outside what the machine can do, faster than it can change.

Such a value is taken as missing: the last good one holds, and the signal grows older until a good one comes. Limits are
those of the description, widened, unless the channels file says otherwise; they are to catch a sensor that shows
85 degC after a reset, not to judge a certified range, of which flags tell.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping
from dataclasses import dataclass

from twin.live.facts import Facts

AIR = (-30.0, 60.0)  # degC: halls and coolants; below the 85 degC that a DS18B20 shows after a reset (its data sheet)
AIR_RATE = 0.5  # K/s: a Pt100 in oil has a time constant of seconds, air in a hall changes by kelvins per minute
BEYOND = 10.0  # times the certified range: a drive's peak current and rapid speed are below that
OVERTRAVEL = 0.2  # of the stroke, on either side


@dataclass(frozen=True)
class Limits:
    """Of a channel, SI."""

    low: float
    high: float
    rate: float  # per second


def limits_of(facts: Facts, given: Mapping[str, Mapping[str, float]]) -> tuple[Limits, ...]:
    """Of every channel; given: column -> low, high, rate, where a file says so."""
    found = []
    for k, c in enumerate(facts.channels):
        rate = math.inf
        if k in facts.axis_channels:
            low, high = facts.strokes[facts.axis_channels.index(k)]
            low, high = low - OVERTRAVEL * (high - low), high + OVERTRAVEL * (high - low)
        elif c.unit == "degC":
            low, high, rate = min(AIR[0], c.low), max(AIR[1], c.high), AIR_RATE
        else:
            most = BEYOND * max(abs(c.low), abs(c.high), 1e-12)
            low, high = -most, most
        told = given.get(c.column, {})
        found.append(Limits(told.get("low", low), told.get("high", high), told.get("rate", rate)))
    return tuple(found)


class Gate:
    """Good values of s channels out of rows; refuses single values, never rows."""

    def __init__(self, facts: Facts, limits: tuple[Limits, ...]):
        self.facts, self.limits = facts, limits
        n = len(limits)
        self.good = [math.nan if c.default is None else c.default for c in facts.channels]
        self.since = [-math.inf] * n  # s: time of the last good value
        self.refused = {"not finite": 0, "out of range": 0, "too fast": 0}
        self.seen = [False] * n  # channels that have ever brought a good value

    def pass_rows(self, times: array[float], rows: array[float]) -> None:
        """Refuse values of rows (n * s) at times (n,) [s] in place: NaN stands for them."""
        n = len(self.limits)
        for k, limit in enumerate(self.limits):
            column = rows[k::n]
            total = sum(column)
            whole = total - total == 0.0 and min(column) >= limit.low and max(column) <= limit.high
            if whole and math.isinf(limit.rate):
                self._took(k, column[-1], times[-1])
                continue
            self._one_by_one(k, limit, times, rows, column)

    def _took(self, k: int, value: float, time: float) -> None:
        self.good[k], self.since[k], self.seen[k] = value, time, True

    def _one_by_one(self, k: int, limit: Limits, times: array[float], rows: array[float], column: array[float]) -> None:
        n = len(self.limits)
        for i, value in enumerate(column):
            if math.isnan(value):  # nothing was logged: no fault of a value
                continue
            why = ""
            if math.isinf(value):
                why = "not finite"
            elif not limit.low <= value <= limit.high:
                why = "out of range"
            elif self.seen[k] and abs(value - self.good[k]) > limit.rate * max(times[i] - self.since[k], 1.0):
                why = "too fast"
            if why:
                self.refused[why] += 1
                rows[i * n + k] = math.nan
            else:
                self._took(k, value, times[i])

    def waiting(self) -> list[str]:
        """Columns without which the machine cannot be stepped, and that have not had a value yet."""
        return [c.column for k, c in enumerate(self.facts.channels) if c.needed and math.isnan(self.good[k])]

    def oldest(self, now: float) -> tuple[float, str]:
        """Age [s] of the oldest good value at a time, of channels that are needed and logged, and whose it is."""
        ages = [(now - self.since[k], c.column) for k, c in enumerate(self.facts.channels) if c.needed and self.seen[k]]
        return max(ages, default=(0.0, ""))

    def stored(self) -> dict[str, object]:
        return {"good": self.good, "since": self.since, "refused": self.refused, "seen": self.seen}

    def restore(self, told: dict) -> None:
        self.good, self.since, self.seen = list(told["good"]), list(told["since"]), list(told["seen"])
        self.refused = dict(told["refused"])
