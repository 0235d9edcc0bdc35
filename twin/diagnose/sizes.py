"""Plays and clocks at several sizes: their responses change in shape with their size, not in height.

A wide play holds the tool nearly still and a narrow one lags a little behind every turn; a clock that is an hour off
shows another hour's heating, not sixty times that of a minute. The bank of columns knows one size of each; here the
others are scored when they are looked for.
"""

from __future__ import annotations

import numpy as np

from twin.diagnose.batch import Batch, Hypothesis
from twin.diagnose.readings import late, play
from twin.diagnose.whiten import Projector
from twin.diagnose.yardstick import Yardstick

SIZES = {
    "slip": (1e-6, 2e-6, 6e-6, 9e-6, 13e-6, 20e-6),  # m
    "clock": (-3600.0, -1200.0, -400.0, 400.0, 1200.0, 3600.0),  # s
}


def sized_candidates(yard: Yardstick, projector: Projector, white: np.ndarray) -> list[Hypothesis]:
    """Plays of every TCP component and clocks of every run that would explain white residuals (m,), at SIZES."""
    found = []
    for batch in yard.columns.batches:
        for i in range(len(batch.places) if batch.kind in SIZES else 0):
            for size in SIZES[batch.kind]:
                change = yard.whiten(_change(yard, batch, i, size))
                P = projector(change)
                statistic = float(P @ (2.0 * white - change))
                if statistic > 0.0:
                    information = float(P @ change) / size**2
                    found.append(Hypothesis(batch, i, batch.histories[0], statistic, (size,), information))
    return found


def _change(yard: Yardstick, batch: Batch, i: int, size: float) -> np.ndarray:
    """(m,) of the nominal machine."""
    study, name = yard.study, batch.places[i]
    if batch.kind == "slip":
        return size * play(study, yard.nominal, name.removeprefix("tcp."), size)
    run = name.removeprefix("runs.")
    states = {k: yard.nominal[k].states for k in study.fitted if study.runs[k].run.name == run}
    return size * late(study, states, size)
