"""Sensors that break: noise where there was none, or a value that is left no more."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.logs.faults.series import Series

_BLOCKS = 16  # of a series; noise shorter than one is not looked for
_FEWEST = 10  # rows of a block
# Of the typical change from row to row in noise, to what 99 % of the rows do not exceed elsewhere. Where a machine
# starts to move, or a coolant to flow, this is at most 1.3 in the clean halves of two real recordings.
_NOISE = 5.0
_REST = 10  # rows that a rail lasts at least, and
_LONGER = 3.0  # times the longest rest of the same channel elsewhere: rounded channels rest, too
_POSSIBLE = (-50.0, 200.0)  # degC: beyond what any sensor on a machine tool can read: a rail, however short
_SHORT = 3  # rows of such a one


@dataclass(frozen=True)
class Stretch:
    """Readings first .. last of a series, and a size: of noise its typical change, of a rail the value."""

    first: int
    last: int
    size: float


def noise(s: Series) -> list[Stretch]:
    """Stretches in which a channel changes from row to row far more than it does anywhere else.

    Stretches without any change are no measure of what is usual: probes stand still while nothing turns.
    """
    change = np.abs(np.diff(s.values))
    width = max(_FEWEST, len(change) // _BLOCKS)
    edges = np.arange(0, len(change) - width + 1, width)
    if len(edges) < 4:
        return []
    blocks = [change[e : e + width] for e in edges]
    moving = [b for b in blocks if np.count_nonzero(b) > 1]
    if len(moving) < 2:
        return []
    calm = max(float(np.quantile([np.quantile(b, 0.9) for b in moving], 0.25)), s.resolution)
    loud = np.array([np.median(b) > _NOISE * calm for b in blocks] + [False])
    found = []
    for first, last in _runs(loud):
        end = len(change) if last == len(blocks) - 1 else edges[last] + width
        inside = np.flatnonzero(change[max(edges[first] - width, 0) : min(end + width, len(change))] > _NOISE * calm)
        inside += max(edges[first] - width, 0)
        found.append((int(inside[0]), int(inside[-1])))
    outside = np.ones(len(change), dtype=bool)
    for a, b in found:
        outside[a : b + 1] = False
    if not found or np.count_nonzero(change[outside]) < _FEWEST:
        return []
    limit = _NOISE * max(float(np.quantile(change[outside & (change > 0.0)], 0.99)), s.resolution)
    typical = [(a, b, float(np.median(change[a : b + 1]))) for a, b in found]
    return [Stretch(a + 1, b + (b == len(change) - 1), size) for a, b, size in typical if size > limit]


def rail(s: Series, leap: int) -> Stretch | None:
    """What follows a leap, where it is a value that a channel of another behaviour keeps, or an impossible one."""
    value = s.values[leap]
    last = _end_of_rest(s.values, leap)
    rest = last - leap + 1
    if not _POSSIBLE[0] < value < _POSSIBLE[1] and s.unit == "degC" and rest >= min(_SHORT, len(s.values) - leap):
        return Stretch(leap, last, float(value))
    elsewhere = max(_longest_rest(s.values[:leap]), _longest_rest(s.values[last + 1 :]))
    if rest >= _REST and rest > _LONGER * elsewhere:
        return Stretch(leap, last, float(value))
    return None


def _end_of_rest(values: np.ndarray, first: int) -> int:
    """The last of the equal readings that begin at `first`."""
    differ = np.flatnonzero(values[first:] != values[first])
    return first + int(differ[0]) - 1 if len(differ) else len(values) - 1


def _longest_rest(values: np.ndarray) -> int:
    """The most equal readings in a row."""
    edges = np.flatnonzero(np.concatenate([[True], np.diff(values) != 0.0, [True]])) if len(values) else np.zeros(1)
    return int(np.max(np.diff(edges), initial=0))


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """First and last index of every run of true ones."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]
