"""A displacement that is not thermal: a step at a tool change or a crash, or one that follows a load at once."""

from __future__ import annotations

import numpy as np

from twin.diagnose.evidence.batch import Batch, History
from twin.diagnose.faults.context import Context, single
from twin.diagnose.faults.fault import Family, Fault
from twin.machine.effects.effect import Window

STEP = Fault("not_thermal", "step", "m", "tcp.", 0, 2e-6, 1e-3, read=True, grows=False)
LOAD = Fault("not_thermal", "load", "m per unit", "tcp.", read=True, lasts=True, grows=False, called="load")
FAULTS = (STEP, LOAD)


def batches(context: Context) -> list[Batch]:
    """Steps and load-proportional displacements."""
    found, study, histories = context.named("step"), context.study, []
    rows = {place: [c for p, _, c in found if p == place] for place, _, _ in found}
    names = list(dict.fromkeys(history for _, history, _ in found))
    for name, weights in zip(names, np.eye(len(names)), strict=True):
        r, start = name.split(":")
        run = study.runs[study.fitted[int(r)]].run
        windows = (Window(run.name, float(start), float(run.drive.time[-1] - run.drive.time[0])),)
        words = f"step at {float(start) / 3600:.1f} h of {run.name}"
        histories.append(History(words, weights[None], windows=windows))
    return [*STEP.batches(list(rows.items()), histories), *single(context, LOAD)]


FAMILY = Family(
    19, "not_thermal", "Non-thermal deviation",
    "A step at a tool change or a crash, or a displacement that follows a load at once.",
    "w + a 1(t > t0);  w + a |load|", "faster than the fastest pole of the machine", "2 um", "either",
    "every TCP component: a step from every measurement on, every current", "reading", batches,
    what="non-thermal deviation", kind_told=True,
)  # fmt: skip
