"""What a temperature channel that is off may read too much, as columns over the bins of all runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from twin.calibrate.channels.readings import Readings

Shape = Literal["leap", "offset", "drift"]
_BEHIND = 3  # bins that a leap must last
_EVERY = 1800.0  # s
BEFORE = 3600.0  # s without a fault at least, at the start of the first run: one that always is has its own history
_LONGEST = 0.75  # of a run: a drift must begin within


@dataclass(frozen=True)
class History:
    """From when to when a channel is off, and how."""

    shape: Shape
    first: int  # bin from which on
    runs: tuple[int, ...]  # numbers of the runs


@dataclass(frozen=True)
class Histories:
    """k of them."""

    of: tuple[History, ...]
    columns: np.ndarray  # (n, k): a leap or offset of 1 K, a drift by 1 K to the end of its run


def histories(r: Readings) -> Histories:
    """Leaps from every bin on to the end of their run, or of all runs that follow; offsets of a run, or of all runs;
    drifts that begin within the first three quarters of a run and go on to its end."""
    of, columns = [], []

    def add(history: History, column: np.ndarray) -> None:
        of.append(history)
        columns.append(column)

    present = [k for k in range(r.runs) if (r.run == k).any()]
    for k in present:
        rows = np.flatnonzero(r.run == k)
        later = tuple(n for n in present if n > k)
        for i in range(len(rows) - _BEHIND):
            step = np.zeros(len(r.run))
            step[rows[i:]] = 1.0
            shape: Shape = "leap" if i else "offset"
            add(History(shape, int(rows[i]), (k,)), step)
            if later and (k != present[0] or r.time[rows[i]] - r.time[rows[0]] >= BEFORE):
                add(History(shape, int(rows[i]), (k, *later)), step + np.isin(r.run, later))
        time, begin = r.time[rows], r.time[rows[0]]
        while begin < time[0] + _LONGEST * (time[-1] - time[0]):
            i = int(np.searchsorted(time, begin))
            ramp = np.zeros(len(r.run))
            ramp[rows[i:]] = (time[i:] - time[i]) / max(time[-1] - time[i], 1.0)
            add(History("drift", int(rows[i]), (k,)), ramp)
            begin += _EVERY
    if len(present) > 1:
        add(History("offset", int(np.flatnonzero(r.run == present[0])[0]), tuple(present)), np.ones(len(r.run)))
    return Histories(tuple(of), np.column_stack(columns))
