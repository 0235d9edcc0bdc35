"""Plays, clocks and lags at several sizes: their responses change in shape with their size, not in height.

A wide play holds the tool nearly still and a narrow one lags a little behind every turn; a clock that is an hour off
shows another hour's heating, not sixty times that of a minute; a sensor that follows in an hour shows no cycle at all.
The bank of columns knows one size of each; here the others are scored when they are looked for.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.diagnose.accepted import curved_change
from twin.diagnose.batch import Hypothesis
from twin.diagnose.whiten import Projector
from twin.diagnose.yardstick import Yardstick

SIZES = {
    "slip": (1e-6, 2e-6, 6e-6, 9e-6, 13e-6, 20e-6),  # m
    "clock": (-3600.0, -1200.0, -400.0, 400.0, 1200.0, 3600.0),  # s
    "lag": (600.0, 1800.0, 5400.0),  # s
}


def sized_candidates(yard: Yardstick, projector: Projector, white: np.ndarray) -> list[Hypothesis]:
    """Plays of TCP components, clocks of runs and lags of sensors that would explain white residuals (m,), at SIZES."""
    found = []
    for batch in yard.columns.batches:
        for i in range(len(batch.places) if batch.kind in SIZES else 0):
            for size in SIZES[batch.kind]:
                h = Hypothesis(batch, i, batch.histories[0], 0.0, (size,), 0.0)
                change = yard.whiten(curved_change(yard, h, size, None))
                P = projector(change)
                statistic = float(P @ (2.0 * white - change))
                if statistic > 0.0:
                    found.append(replace(h, statistic=statistic, information=float(P @ change) / size**2))
    return found
