"""Readings that leap away and come back within three rows: a plug that is touched, a telegram that was garbled.

Of a channel that heat moves, however fast, a reading lies between what was read before and after it, but for noise.
With medians of five readings on either side, which three wrong ones make wrong (breakdown point: Huber, Robust
Statistics, 1981, 1.4; as a filter: Hampel, J. Am. Stat. Assoc. 69, 1974), what lies outside both is judged by what the
same channel does everywhere else. One such reading decides the mean of its bin, and a bin a fit by least squares.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from twin.logs.faults.breaks import POSSIBLE, Stretch
from twin.logs.faults.leaps import LEAST
from twin.logs.faults.series import Series

_SIDE = 5  # rows on each side
_LONGEST = 3  # rows: of the five on either side of any of them two are wrong at most
# Of the next two, as in `leaps`: tails are heavier than a normal distribution's, so the largest other one counts
_RATIO = 4.0  # of the smallest spike of a channel to the largest other departure
_SCALE = 5.0  # to what 98 % of the rows do not exceed, or to the last digit
_MOST = 8  # in one channel: with more of them it is noisy
_ROWS = 30  # for each of them: of a few rows some always stand out
_AT_ONCE = 0.8  # of it in one row, there and back: slower ones may be heat
_USUAL = 120.0  # s between rows, beyond which a light part warms and cools between two rows


def spikes(s: Series) -> list[Stretch]:
    """Stretches of up to three readings of a temperature, with how far [K] the farthest departs."""
    away = _away(s.values)
    found, impossible = _stretches(away), (s.values < POSSIBLE[0]) | (s.values > POSSIBLE[1])
    found = [f for f in found if f.last - f.first < _LONGEST and _at_once(s.values, f)]
    found.sort(key=lambda f: -abs(f.size))
    usual = max(float(np.quantile(np.abs(away), 0.98)), s.resolution)
    most = min(_MOST, len(s.values) // _ROWS) if float(np.median(np.diff(s.time))) <= _USUAL else 0
    sizes, kept = [*(abs(f.size) for f in found), 0.0], 0
    for k, size in enumerate(sizes[:-1][:most], start=1):
        if size >= max(_RATIO * sizes[k], _SCALE * usual, LEAST[s.unit]):
            kept = k
    never = [f for f in found[kept:] if impossible[f.first : f.last + 1].all()]
    return sorted([*found[:kept], *never], key=lambda f: f.first)


def _away(values: np.ndarray) -> np.ndarray:
    """(n,) how far each reading lies outside of what was read before and after it; 0 within five rows of the ends."""
    n, away = len(values), np.zeros(len(values))
    if n <= 2 * _SIDE:
        return away
    level = np.median(sliding_window_view(values, _SIDE), axis=1)  # of the rows i .. i + 4
    before, after, inner = level[: n - 2 * _SIDE], level[_SIDE + 1 :], values[_SIDE : n - _SIDE]
    away[_SIDE : n - _SIDE] = inner - np.clip(inner, np.minimum(before, after), np.maximum(before, after))
    return away


def _stretches(away: np.ndarray) -> list[Stretch]:
    """The farthest departures, each with its neighbours to the same side that are half as far at least."""
    peak, found = np.abs(away), list[Stretch]()
    left = peak.copy()
    while len(found) <= _MOST and left.any():
        i = int(np.argmax(left))
        first = last = i
        while first > 0 and away[first - 1] * away[i] > 0.0 and peak[first - 1] > peak[i] / 2.0:
            first -= 1
        while last + 1 < len(away) and away[last + 1] * away[i] > 0.0 and peak[last + 1] > peak[i] / 2.0:
            last += 1
        left[max(first - 1, 0) : last + 2] = 0.0
        found.append(Stretch(first, last, float(away[i])))
    return found


def _at_once(values: np.ndarray, f: Stretch) -> bool:
    """Whether it goes and comes back within a row."""
    there, back = values[f.first] - values[f.first - 1], values[f.last] - values[f.last + 1]
    return min(there * np.sign(f.size), back * np.sign(f.size)) >= _AT_ONCE * abs(f.size)
