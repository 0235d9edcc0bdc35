"""A displacement that is not thermal: a step at a tool change or a crash, or one that follows a load at once."""

from __future__ import annotations

import numpy as np

from twin.diagnose.evidence.batch import Batch, History
from twin.diagnose.faults.context import Context, called
from twin.diagnose.faults.fault import Family, Fault
from twin.machine.effects.effect import Window

STEP = Fault("not_thermal", "step", "m", "tcp.", 0, 2e-6, 1e-3, read=True, instant=True, grows=False)
LOAD = Fault("not_thermal", "load", "m per unit", "tcp.", read=True, lasts=True, instant=True, grows=False)
FAULTS = (STEP, LOAD)


def batches(context: Context) -> list[Batch]:
    """Steps and load-proportional displacements."""
    rows: dict[str, list[tuple[str, int]]] = {}
    for place, history, column in context.named("step"):
        rows.setdefault(place, []).append((history, column))
    result, study = [], context.study
    if rows:
        names = [h for h, _ in next(iter(rows.values()))]
        histories = []
        for i, name in enumerate(names):
            r, start = name.split(":")
            run = study.runs[study.fitted[int(r)]].run
            windows = (Window(run.name, float(start), float(run.drive.time[-1] - run.drive.time[0])),)
            words = f"step at {float(start) / 3600:.1f} h of {run.name}"
            histories.append(History(words, np.eye(len(names))[[i]], windows=windows))
        result.append(STEP.batch([(p, [c for _, c in own]) for p, own in rows.items()], histories))
    return [*result, *called(context, LOAD, "load")]


FAMILY = Family(
    19, "not_thermal", "Not thermal",
    "A step at a tool change or a crash, or a displacement that follows a load at once.",
    "w + a 1(t > t0);  w + a |load|", "faster than the fastest pole of the machine", "2 um", "either",
    "every TCP component: a step from every measurement on, every current", "reading", batches,
    what="a deviation that is not thermal", kind_told=True,
)  # fmt: skip
