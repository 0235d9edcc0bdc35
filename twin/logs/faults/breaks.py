"""Sensors that break: noise where there was none, or a value that is left no more."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.logs.faults.leaps import LEAST
from twin.logs.faults.series import Series

_BLOCKS = 16  # of a series; noise shorter than one is not looked for
_FEWEST = 10  # rows of a block
# Departures elsewhere, from which on they say what is usual: a rounded temperature has few in slow air, and heat is
# never noise; a probe may have some while nothing turns, and is louder when something does
_CALM = {"degC": 5, "m": 20}
# Of the typical departure from the neighbours in noise, to what 99 % of the rows do not exceed elsewhere, or to the
# last digit: in 12 clean days of a lathe and 16 h of a spindle no block of rows reaches 1
_NOISE = 3.0
# The same, to what the sound readings span: a sensor beside a winding flickers with each cut by a per cent of its rise
_SPAN = 0.05
_REST = 10  # rows that a rail lasts at least, and what a logger repeats until a leap, and
_LONGER = 3.0  # times the longest rest of the same channel elsewhere: rounded channels rest, too
_DIGIT = 1.5  # last digits, between one and two
_STUCK = 20  # rows, of a rest that a leap ends
_OFTEN = 0.9  # of the rests of a channel, the shorter ones: usual
LONGEST = 1800.0  # s, of what a logger repeats: a sensor that stands still for longer is stuck
POSSIBLE = (-50.0, 200.0)  # degC: beyond what any sensor on a machine tool can read: a rail, however short
_SHORT = 3  # rows of such a one


@dataclass(frozen=True)
class Stretch:
    """Readings first .. last of a series, and a size: of noise its typical departure, of a rail the value."""

    first: int
    last: int
    size: float


def noise(s: Series) -> list[Stretch]:
    """Stretches in which readings depart from the mean of their two neighbours far more than anywhere else.

    Heat moves a reading and its neighbours alike. Blocks of rows are parted into calm and loud ones wherever that
    leaves the loud ones far above all others. Rows without any departure are no measure of what is usual: probes stand
    still while nothing turns.
    """
    away = np.abs(s.values[1:-1] - 0.5 * (s.values[:-2] + s.values[2:]))  # (n - 2,) of the second row on
    width = max(_FEWEST, len(away) // _BLOCKS)
    blocks = [away[e : e + width] for e in range(0, len(away) - width + 1, width)]
    levels = sorted({max(float(np.quantile(b, 0.9)), s.resolution) for b in blocks})
    typical = np.array([np.median(b) for b in blocks])
    for calm in reversed(levels[:-1]):
        runs = _runs(typical > _NOISE * calm)
        found = _edges(away, [(a * width, (b + 1) * width) for a, b in runs], width, _NOISE * calm)
        outside = np.ones(len(away), dtype=bool)
        for first, last in found:
            outside[first : last + 1] = False
        usual = away[outside & (away > 0.0)]
        if not found or len(usual) < _CALM[s.unit]:
            continue
        limit = max(
            _NOISE * float(np.quantile(usual, 0.99)), _NOISE * s.resolution, _SPAN * _spanned(s.values, found),
            LEAST[s.unit],
        )  # fmt: skip
        sizes = [float(np.median(away[first : last + 1])) for first, last in found]
        if min(sizes) > limit:
            return [_stretch(*edges, size, len(away)) for edges, size in zip(found, sizes, strict=True)]
    return []


def _spanned(values: np.ndarray, noisy: list[tuple[int, int]]) -> float:
    """The range of the readings outside of stretches of departures, which are those of the rows from the second on."""
    sound = np.ones(len(values), dtype=bool)
    for first, last in noisy:
        sound[first : last + 3] = False
    return float(np.ptp(values[sound])) if sound.any() else 0.0


def _stretch(first: int, last: int, size: float, n: int) -> Stretch:
    """Of large departures first .. last of n: the outermost ones belong to sound readings beside a wrong one."""
    return Stretch(0 if first == 0 else first + 2, last + 2 if last == n - 1 else last, size)


def _edges(away: np.ndarray, rough: list[tuple[int, int]], width: int, large: float) -> list[tuple[int, int]]:
    """First and last large departure of every rough stretch, looked for one block farther on each side."""
    found: list[tuple[int, int]] = []
    for begin, end in rough:
        low = max(begin - width, 0)
        inside = low + np.flatnonzero(away[low : end + width] > large)
        first, last = int(inside[0]), int(inside[-1])
        if found and first <= found[-1][1] + 1:
            first, last = found[-1][0], max(last, found[-1][1])
            found.pop()
        found.append((first, last))
    return found


def rail(s: Series, leap: int) -> Stretch | None:
    """What follows a leap, where it is a value that a channel of another behaviour keeps, or an impossible one."""
    value = s.values[leap]
    last = _end_of_rest(s.values, leap)
    rest = last - leap + 1
    if not POSSIBLE[0] < value < POSSIBLE[1] and s.unit == "degC" and rest >= min(_SHORT, len(s.values) - leap):
        return Stretch(leap, last, float(value))
    elsewhere = max(_longest_rest(s.values[:leap]), _longest_rest(s.values[last + 1 :]))
    if rest >= _REST and rest > _LONGER * elsewhere:
        return Stretch(leap, last, float(value))
    return None


def rest_before(s: Series, leap: int) -> Stretch | None:
    """The longest rest of a channel, where it ends by a leap: the channel was stuck, and did not rest. Up to LONGEST it
    need be far longer than usual alone: a logger repeats readings now and then."""
    differ = np.flatnonzero(s.values[:leap] != s.values[leap - 1])
    first = int(differ[-1]) + 1 if len(differ) else 0
    elsewhere = max(_longest_rest(s.values[:first]), _longest_rest(s.values[leap:]))
    usual = float(np.quantile(rests(s.values), _OFTEN))
    repeated = s.time[leap] - s.time[first] <= LONGEST and leap - first >= max(_REST, _LONGER * usual)
    if repeated or leap - first > max(_STUCK, elsewhere):
        return Stretch(first, leap - 1, float(s.values[first]))
    return None


def rests_by_rounding(s: Series, last: int) -> bool:
    """Whether a rest that ends at `last` ends by one digit, in a channel that changes digit by digit: whatever it was,
    nothing was lost. Rounded channels rest for hours where a temperature turns."""
    change = np.abs(np.diff(s.values))
    one = _DIGIT * s.resolution
    return last < len(change) and change[last] <= one and float(np.median(change[change > 0.0])) <= one


def _end_of_rest(values: np.ndarray, first: int) -> int:
    """The last of the equal readings that begin at `first`."""
    differ = np.flatnonzero(values[first:] != values[first])
    return first + int(differ[0]) - 1 if len(differ) else len(values) - 1


def rests(values: np.ndarray) -> np.ndarray:
    """How many equal readings stand in a row, one number for each row of them."""
    edges = np.flatnonzero(np.concatenate([[True], np.diff(values) != 0.0, [True]])) if len(values) else np.zeros(1)
    return np.diff(edges)


def _longest_rest(values: np.ndarray) -> int:
    return int(np.max(rests(values), initial=0))


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """First and last index of every run of true ones."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]
