"""Readings that a logger repeats for minutes: of a channel whose noise changes its last digit from row to row.

Heat does not wait, and the reading after such a stretch leaps. With a share p of changes from row to row, k equal
readings one after the other have a probability of (1 - p)^k where noise makes the changes. In a rounded channel, where
the temperature makes them, they come together and say nothing.
"""

from __future__ import annotations

import numpy as np

from twin.logs.faults.breaks import Stretch
from twin.logs.faults.series import Series

_NOISE = 0.5  # share of changes, from which on noise and not the temperature makes them: it is beyond the last digit
_RARE = 25.0  # - logarithm of the probability: as of standstills (`twin.logs.stuck`)
_USUAL = 0.98  # of all rests, the shorter ones: what a logger repeats is among the others
_SURELY = 0.99  # share of changes, at most: no few hundred rows tell more
LONGEST = 1800.0  # s, of what a logger repeats: a sensor that stands still for longer is stuck


def held(s: Series) -> list[Stretch]:
    """Stretches that repeat the reading before them."""
    edges = np.flatnonzero(np.concatenate([[True], np.diff(s.values) != 0.0, [True]]))
    rests = np.diff(edges)
    usual = rests[rests <= np.quantile(rests, _USUAL)]
    share = min(len(usual) / usual.sum(), _SURELY)
    found = np.flatnonzero(rests * -np.log1p(-share) >= _RARE) if share >= _NOISE else []
    return [Stretch(int(edges[k]) + 1, int(edges[k + 1]) - 1, float(s.values[edges[k]])) for k in found]
