"""Heat from the sun, or a hot neighbour: for some hours of the day, another height every day."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.evidence import bells
from twin.diagnose.evidence.batch import Batch, History
from twin.diagnose.faults.context import Context
from twin.diagnose.faults.fault import Described, Family
from twin.diagnose.faults.heat_source import Heat
from twin.diagnose.model.study import Study

HOUR = 3600.0  # s
SOLAR = 1000.0  # W/m^2: the sun at the ground, upright on a surface that keeps all of it
BELLS = (4 * HOUR, 6 * HOUR, 8 * HOUR, 10 * HOUR)


@dataclass(frozen=True)
class Sun(Heat):
    """Heat at a place, an amplitude per run."""

    def described(self, study: Study, d: Described, a: np.ndarray, covariance: np.ndarray) -> Described:
        """One size, a level per day."""
        if len(a) < 2:
            return d
        scale, windows = float(max(a)) / d.size[0] if d.size[0] else 1.0, d.windows
        value, low, high = (v * scale for v in d.size)
        if value > 0:
            order = list(dict.fromkeys(w.run for w in windows))
            windows = tuple(replace(w, level=w.level * max(float(a[order.index(w.run)]), 0.0) / value) for w in windows)
        return replace(d, size=(value, low, high), windows=windows)


SUN = Sun("sun", "heat", "W", "", 1, least=2.0, positive=True, own=0.12, grows=False)  # on no day does it cool
FAULTS = (SUN,)


def batches(context: Context) -> list[Batch]:
    """Bells on every outer surface, at the same hours of every run, an amplitude per run."""
    study, blocks = context.study, context.elements.histories.blocks
    runs, histories = study.fitted_runs, []
    longest = max((start + end) / 2 * runs[i][1] for i, start, end in blocks)
    for length in BELLS:
        for centre in np.arange(length / 2, longest + HOUR, HOUR):
            bell = bells.Bell((float(centre),) * len(runs), length)
            weights, windows = bells.by_blocks(runs, blocks, bell)
            if (np.abs(weights).sum(axis=1) > 0).all():
                histories.append(History(bells.name(bell, runs), weights, windows=windows, bell=bell))
    rows = [(p.name, list(context.elements.heat_blocks[p.name])) for p in context.outer]
    return SUN.batches(rows, histories, [SOLAR * p.area for p in context.outer])


FAMILY = Family(
    7, "sun", "Sun or a hot neighbour on one side",
    "Radiation warms one side for some hours of the day; clouds make each day another.",
    "a_day b_side w(t)", "a half sine of hours on one side, another height every day", "2 W", "positive",
    "every outer surface; half sines of 4 to 10 h, an amplitude per run", "machine", batches,
    what="heat from the sun",
)  # fmt: skip
