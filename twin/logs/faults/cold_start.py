"""Temperatures that begin apart from all others, and whether the machine was cold then: only at rest do all agree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.logs.channels import PLACES
from twin.logs.faults.breaks import POSSIBLE
from twin.logs.faults.series import Series
from twin.logs.run import Run
from twin.logs.slips import other_scale

_BEGIN = 5  # rows; a channel begins apart if it is apart in all of them
_STAYS = 0.5  # of the size: not a single wrong value
_FEWEST = 4  # channels, to tell which one is off
# Of the largest deviation from the median to the next one: at the starts of the clean half of a real lathe, whose
# thermocouples and resistance sensors differ by 3 K, and of a real spindle, it is at most 1.53
_RATIO = 2.0
_LEAST = 1.5  # K, of a deviation: a thermocouple of class 1 (IEC 60584-1) may be off by that
# s: the slowest time constant of a machine tool's structure. A warm place falls at least at its excess over this
_SLOWEST = 4.0 * 3600.0
_SURE = 5.0  # of the fall that a warm place would show during the rest, to the noise of the fall that is seen
_FALLS = 0.5  # of the fall of a warm place: less is none


@dataclass(frozen=True)
class Apart:
    """A channel that begins apart from all others."""

    name: str
    size: float  # K above the median of the others
    cold: bool  # the machine is known to be cold: nothing is driven, and nothing falls as a warm place would


def begins_apart(run: Run, series: list[Series]) -> Apart | None:
    """The one temperature that begins far from all others; None where none does, or several differ alike.

    series: the temperatures. Temperatures among the loads count among the others.
    """
    first = {s.name: s.values[s.row < _BEGIN] for s in series if s.row[0] < _BEGIN}
    begin = {name: float(values[0]) for name, values in first.items()}
    air = [v[np.isfinite(v)] for n, v in run.loads.columns.items() if run.loads.units[n] == "degC"]
    levels = [*begin.values(), *(float(v[0]) for v in air if len(v))]
    if len(levels) < _FEWEST or not begin:
        return None
    name = max(begin, key=lambda n: abs(begin[n] - np.median(levels)))
    others = list(levels)
    others.remove(begin[name])
    usual = float(np.median(others))
    size = begin[name] - usual
    if abs(size) < max(_LEAST, _RATIO * float(np.max(np.abs(np.array(others) - usual)))):
        return None
    if np.min((first[name] - usual) / size) < _STAYS:
        return None
    if other_scale(begin[name], usual) or not POSSIBLE[0] < begin[name] < POSSIBLE[1]:
        return None  # told as a slip of the unit, or as a value that no machine has
    stated = run.initial_temperature is not None
    return Apart(name, size, stated or _cold(series, rest_at_start(run), size))


def rest_at_start(run: Run) -> float:
    """How long nothing is driven from the start on [s]: all loads but positions and temperatures are zero."""
    drives = [v for n, v in run.loads.columns.items() if run.loads.units[n] not in (*PLACES, "degC")]
    if not drives:
        return 0.0
    works = np.flatnonzero(np.any(np.nan_to_num(np.array(drives)) != 0.0, axis=0))
    last = works[0] if len(works) else len(run.loads.time) - 1
    return float(run.loads.time[last] - run.loads.time[0])


def _cold(series: list[Series], rest: float, size: float) -> bool:
    """Whether all channels stay where they begin so long that a place as warm as `size` [K] would be seen to fall."""
    for s in series:
        during = s.values[s.time <= s.time[0] + rest]
        third = len(during) // 3
        if third < _BEGIN:
            return False
        fell = abs(float(np.median(during[-third:]) - np.median(during[:third])))
        noise = max(s.resolution, float(np.median(np.abs(np.diff(during)))))
        warm = abs(size) * (2.0 / 3.0) * rest / _SLOWEST  # between the middles of the first and last third
        if warm < _SURE * noise or fell > _FALLS * warm:
            return False
    return True
