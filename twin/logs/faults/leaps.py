"""Changes within one row that heat cannot make, judged by what the same channel does everywhere else.

The change at a row is the median of the readings after it minus the median of those before; of it counts only what lies
outside of the changes just before and just after. A channel that heats, however fast, changes in a row by an amount
between those of its neighbours, so nothing of it counts, and single wrong values vanish in the medians.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from twin.logs.faults.series import Series

# rows on each side of a leap: the fewest of which a median ignores a single wrong value
_SIDE = 3
# Of the next two: 12 clean days of a lathe and 16 h of a spindle, 333 channels, reach 2.9 and 5.2, one probe at the
# start of the spindle; all others 2.1 and 3.5, where no probe comes from a rest. Tails are far heavier than a normal
# distribution's, so that the largest other change counts, and not a multiple of a standard deviation alone.
_RATIO = 4.0  # of the smallest leap of a channel to its largest other change
_SCALE = 5.0  # of a leap to what 98 % of the rows do not exceed, or to the last digit
# The same, where most channels do it in one row: in the recordings above at most 3 of 16 do
_TOGETHER = 2.0
# The same as _RATIO, of a leap that ends at zero to the last digit: that one of several large changes does so by chance
# has a probability of one in the digits of its range, a hundred or more
_ZEROED = 1.5
_FAR = 10.0  # last digits from zero, before
_MOST = 8  # leaps in one channel; with more of them no change is unusual
_ROWS = 30  # for each of them: of a few rows some always stand out
# The smallest that is told: a tenth of what thermocouples of one machine differ by, and the noise of a probe
LEAST = {"degC": 0.5, "m": 2e-6}
# A leap is over in its row: of the change to the median of three rows, a first-order lag makes at most 73 % in the
# first row if its time constant is a row or more. Faster ones look like leaps.
_AT_ONCE = 0.8
_PACE = 10  # rows over which the fastest change of a channel is taken, to judge a gap by
_GAP = 1.5  # usual steps


@dataclass(frozen=True)
class Changes:
    """What of each change heat does not explain, and the scale of these amounts where nothing happens."""

    change: np.ndarray  # (n,) from the three readings before a row to the three from it on, 0 near the ends
    excess: np.ndarray  # (n,) of that, 0 within six rows of the ends
    usual: float  # what 98 % of them do not exceed, or the last digit


def changes(s: Series) -> Changes:
    """How much of each change lies outside of its neighbours. The first and last 2 x 3 rows cannot be judged."""
    n, k = len(s.values), _SIDE
    change, excess = np.zeros(n), np.zeros(n)
    if n <= 4 * k:
        return Changes(change, excess, 0.0)
    level = np.median(sliding_window_view(s.values, k), axis=1)  # (n - k + 1,) of the rows i .. i + k - 1
    change[k : n - k + 1] = level[k:] - level[:-k]
    inner = slice(2 * k, n - 2 * k + 1)
    before, after = change[k : n - 3 * k + 1], change[3 * k : n - k + 1]
    between = np.clip(change[inner], np.minimum(before, after), np.maximum(before, after))
    excess[inner] = change[inner] - between
    excess = np.sign(excess) * np.maximum(np.abs(excess) - _in_gaps(s), 0.0)
    return Changes(change, excess, _usual(s, excess))


def leaps(s: Series, c: Changes) -> list[tuple[int, float]]:
    """Index in the series of the first reading after each leap, and its size; in the order of time."""
    peaks = _peaks(c.excess, _MOST + 1)
    sizes = [abs(float(c.excess[i])) for i in peaks] + [0.0]
    others = c.excess.copy()
    found = 0
    for m, peak in enumerate(peaks[: min(_MOST, max(1, len(s.values) // _ROWS))]):
        others[peak - 1 : peak + 2] = 0.0
        if sizes[m] >= max(_RATIO * sizes[m + 1], _SCALE * _usual(s, others), LEAST[s.unit]):
            found = m + 1
    return sorted((at, size) for at, size in (_located(s, c, i) for i in peaks[:found]) if size != 0.0)


def set_to_zero(s: Series, c: Changes) -> tuple[int, float] | None:
    """The first reading after a probe was set to zero, and the leap, where it shows exactly that: the largest change of
    all ends at zero to the last digit, far from where it was."""
    peaks = _peaks(c.excess, 2)
    if not peaks or abs(c.excess[peaks[0]]) < _TOGETHER * c.usual:
        return None
    at, size = _located(s, c, peaks[0])
    other = abs(c.excess[peaks[1]]) if len(peaks) > 1 else 0.0
    exact = abs(s.values[at]) <= 0.5 * s.resolution and abs(s.values[at - 1]) > _FAR * s.resolution
    return (at, size) if size != 0.0 and exact and abs(size) >= _ZEROED * other else None


def leapt_together(series: Sequence[Series], all_changes: Sequence[Changes]) -> dict[int, dict[str, float]]:
    """Rows of the table in which most channels leap, three at least: their leaps by name."""
    rows: dict[int, dict[str, float]] = {}
    for s, c in zip(series, all_changes, strict=True):
        large = [i for i in _peaks(c.excess, _MOST) if abs(c.excess[i]) > _TOGETHER * max(c.usual, 1e-300)]
        for at, size in (_located(s, c, i) for i in large):
            if size != 0.0:
                rows.setdefault(int(s.row[at]), {})[s.name] = size
    enough = max(3, (len(series) + 1) // 2)
    found: dict[int, dict[str, float]] = {}
    for row in sorted(rows, key=lambda r: -len(rows[r])):  # noise may move a leap by one row
        sizes = {**rows.get(row - 1, {}), **rows.get(row + 1, {}), **rows[row]}
        if len(sizes) >= enough and not any(abs(row - r) <= _SIDE for r in found):
            found[row] = sizes
    return dict(sorted(found.items()))


def _located(s: Series, c: Changes, peak: int) -> tuple[int, float]:
    """The row of a leap, and its size: zero where the change takes several rows. Medians blur it by one row."""
    near = np.arange(peak - 1, peak + 2)
    steps = s.values[near] - s.values[near - 1]
    best = int(np.argmax(steps * np.sign(c.excess[peak])))
    at = int(near[best])
    # a bearing that cooled while its spindle stood begins at its last reading, not at the median of the three before
    whole = max(abs(float(np.median(s.values[at : at + _SIDE]) - s.values[at - 1])), abs(c.change[at]))
    done = abs(steps[best]) >= _AT_ONCE * whole
    return int(near[best]), float(c.excess[peak]) if done else 0.0


def _usual(s: Series, excess: np.ndarray) -> float:
    return max(float(np.quantile(np.abs(excess), 0.98)), s.resolution)


def _peaks(excess: np.ndarray, most: int) -> list[int]:
    """Where the magnitudes are largest, largest first, none within three rows of another of its sign."""
    left = excess.copy()
    found: list[int] = []
    while len(found) < most and left.any():
        i = int(np.argmax(np.abs(left)))
        found.append(i)
        near = slice(max(i - _SIDE, 0), i + _SIDE + 1)
        left[near] = np.where(left[near] * left[i] > 0.0, 0.0, left[near])
    return found


def _in_gaps(s: Series) -> np.ndarray:
    """(n,) what the channel may have changed while nothing was logged before a row: at its fastest pace elsewhere."""
    step = np.diff(s.time, prepend=s.time[0])
    usual = float(np.median(step[1:]))
    gap = step > _GAP * usual
    if not gap.any() or len(s.values) <= _PACE:
        return np.zeros(len(s.values))
    took, moved = (np.abs(v[_PACE:] - v[:-_PACE]) for v in (s.time, s.values))
    whole = took < _GAP * usual * _PACE
    for i in np.flatnonzero(gap):
        whole[max(i - _PACE, 0) : i + 1] = False
    pace = float(np.max(moved[whole] / took[whole], initial=0.0))
    lost = np.where(gap, pace * step, 0.0)
    return np.asarray(np.maximum(lost, np.maximum(np.roll(lost, 1), np.roll(lost, -1))))  # medians blur by one row
