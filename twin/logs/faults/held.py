"""Readings that a logger repeats for minutes: of a channel whose noise changes its last digit from row to row.

Heat does not wait, and the reading after such a stretch leaps. With a share p of changes from row to row, k equal
readings one after the other have a probability of (1 - p)^k where noise makes the changes. In a rounded channel, where
the temperature makes them, they come together and say nothing: there a leap must end the rest (`breaks.rest_before`).
"""

from __future__ import annotations

import numpy as np

from twin.logs.faults.breaks import Stretch, rests
from twin.logs.faults.series import Series

_NOISE = 0.7  # share of changes, from which on noise makes them: rounded channels of a real lathe have up to 0.65
_RARE = 1e-6  # found by chance in a run, on an average
_USUAL = 0.98  # of the rests of a channel, the shorter ones: what a logger repeats is among the others
_SURELY = 0.99  # share of changes, at most: no few hundred rows tell more


def held(s: Series) -> list[Stretch]:
    """Stretches that repeat the reading before them."""
    lasting = rests(s.values)
    usual = lasting[lasting <= np.quantile(lasting, _USUAL)]
    share = min(len(usual) / usual.sum(), _SURELY)
    if share < _NOISE:
        return []
    end = np.cumsum(lasting)
    return [
        Stretch(int(end[k] - lasting[k]) + 1, int(end[k]) - 1, float(s.values[end[k] - 1]))
        for k in np.flatnonzero(len(s.values) * (1.0 - share) ** lasting <= _RARE)
    ]
