"""Hypotheses as slots of the time integration: the exact model with a cause switched on, for refits and for the sealed
run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twin.diagnose.evidence import bells
from twin.diagnose.evidence.batch import History, Hypothesis
from twin.diagnose.faults.elements import Elements
from twin.diagnose.faults.fault import Slot, Unit
from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.slots import Slots
from twin.diagnose.model.study import Study
from twin.diagnose.result.diagnosis import Window

AT_THE_END = 1.0  # s before the end of a run, which is none of its own: rounding


def units_of(study: Study, h: Hypothesis) -> tuple[Unit, ...]:
    """The amplitudes of a hypothesis in every run of the study, the sealed one included; none for readings.

    Histories of logged signals and the sun go on in the sealed run; windows are there only where the hypothesis lasts.
    """
    runs = range(len(study.runs))
    return fault_of(h).units(h, lambda which: tuple(_shape(study, h.when, which, k) for k in runs))


def _shape(study: Study, when: History, which: int, k: int) -> np.ndarray:
    """(n,) of the amplitude `which` in run k."""
    run = study.runs[k].run
    n, t, fitted = run.drive.n_steps, np.asarray(run.drive.time), k in study.fitted
    if when.bell is not None:  # an amplitude per run, the mean of them in others
        middle = (t[:-1] + t[1:]) / 2 - t[0]
        if not fitted:
            return np.asarray(bells.level(middle, when.bell.middle, when.bell.length) / len(study.fitted))
        return when.bell.level(middle, which) if k == study.fitted[which] else np.zeros(n)
    if when.signal:
        values = run.signals.get(when.signal)
        return np.zeros(n) if values is None else np.asarray(np.abs(values / when.reference) ** when.exponent)
    if not when.windows or (not fitted and lasts(study, when.windows)):
        return np.ones(n)
    shape = np.zeros(n)
    for w in when.windows:
        if w.run == run.name:
            within = np.clip(np.minimum(t[1:], w.end) - np.maximum(t[:-1], w.start), 0.0, None)
            shape += w.level * within / (t[1] - t[0])
    return shape


def lasts(study: Study, windows: Sequence[Window]) -> bool:
    """Whether windows end with the last fitted run: the cause has come to stay."""
    last = study.runs[study.fitted[-1]].run
    end = last.drive.time[-1] - last.drive.time[0]
    to_the_end = any(w.run == last.name and w.end > end - AT_THE_END for w in windows)
    return to_the_end and all(w.level == 1.0 for w in windows)


def ended(study: Study, h: Hypothesis) -> Hypothesis:
    """A hypothesis that no longer acts after the fitted runs; unchanged where it does not last."""
    if not lasts(study, h.when.windows):
        return h
    name = study.runs[study.fitted[-1]].run.name
    windows = tuple(replace(w, end=w.end - 2.0 * AT_THE_END) if w.run == name else w for w in h.when.windows)
    told = h.when.name
    told = f"{told.removesuffix(' on')} to the end of {name}" if told.endswith(" on") else told
    return replace(h, when=replace(h.when, name=told, windows=windows))


def slots_with(study: Study, elements: Elements, units: Sequence[Unit], k: int) -> Slots:
    """The slots of run k with these amplitudes, in their order. Raises ValueError for more than there are slots."""
    slots = study.slots(k)
    if len(units) > slots.gate.shape[1]:
        raise ValueError("more amplitudes than slots")
    for s, unit in enumerate(units):
        unit.fault.fill(Slot(slots, s, unit, k, study, elements))
    return slots
