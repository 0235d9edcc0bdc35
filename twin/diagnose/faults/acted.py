"""Hypotheses as slots of the time integration: the exact model with a cause switched on, for refits and for the sealed
run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.diagnose.evidence import bells
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.faults.elements import Elements
from twin.diagnose.model.integration import INNER
from twin.diagnose.model.slots import Slots
from twin.diagnose.model.study import Study
from twin.diagnose.result.diagnosis import Window

READINGS = frozenset({  # kinds that act on what is read, see `readings`
    "gain", "offset", "drift", "lag", "detached", "swapped", "clock", "scale", "expansion", "slip", "step", "load",
    "probe", "frame", "heated",
})  # fmt: skip


CONDUCTS = ("group", "joint", "contact")  # kinds whose amplitude is a relative change of a conductance
RELATIVE = (*CONDUCTS, "expansion")  # kinds whose amplitude is a relative change


@dataclass(frozen=True)
class Unit:
    """One amplitude of a cause: what it is, and when it acts."""

    kind: str
    place: str
    column: int  # a column of the bank of the same vector, -1 if none
    shapes: tuple[np.ndarray, ...]  # per run of the study (n_fine,): history of unit amplitude


def units_of(study: Study, h: Hypothesis) -> tuple[Unit, ...]:
    """The amplitudes of a hypothesis in every run of the study, the sealed one included; none for readings.

    Histories of logged signals and the sun go on in the sealed run; windows are there only where the hypothesis lasts.
    """
    kind = h.batch.kind
    if kind in READINGS:
        return ()
    place = h.name.removeprefix("films.").removeprefix("environment.").removeprefix("contacts.")
    if kind in ("heat", "film", "coolant", "capacity"):  # at places, some of which are the pads of "contacts.X"
        place = h.name
    columns, weights = h.combination()
    if kind == "coolant":
        half = weights.shape[1] // 2
        return (
            Unit("wetted", place, int(columns[0]), _shapes(study, h, 0)),
            Unit("heat", place, int(columns[half]), _shapes(study, h, 1)),
        )
    if kind in ("moved", "start", "signal", "source", "gradient"):
        place = h.name
    units = []
    for which, row in enumerate(weights):
        lead = int(columns[np.flatnonzero(row)[0]]) if row.any() else int(columns[0])
        units.append(Unit(kind, place, lead, _shapes(study, h, which)))
    return tuple(units)


def _shapes(study: Study, h: Hypothesis, which: int) -> tuple[np.ndarray, ...]:
    """Of the amplitude `which`."""
    when = h.when
    result = []
    for k, planned in enumerate(study.runs):
        run = planned.run
        n = run.drive.n_steps
        if when.windows:
            shape, t = np.zeros(n), np.asarray(run.drive.time)
            if when.bell is not None:  # an amplitude per run, the mean of them in others
                middle = (t[:-1] + t[1:]) / 2 - t[0]
                if k == study.fitted[which]:
                    shape = when.bell.level(middle, which)
                elif k not in study.fitted:
                    shape = bells.level(middle, when.bell.middle, when.bell.length) / len(study.fitted)
            else:
                for w in when.windows:
                    if w.run == run.name:
                        within = np.clip(np.minimum(t[1:], w.end) - np.maximum(t[:-1], w.start), 0.0, None)
                        shape += w.level * within / (t[1] - t[0])
            if when.bell is None and k not in study.fitted and _lasts(study, when.windows):
                shape[:] = 1.0
        elif when.signal:
            values = run.signals.get(when.signal)
            shape = np.zeros(n) if values is None else np.abs(values / when.reference) ** when.exponent
        else:
            shape = np.ones(n)
        result.append(shape)
    return tuple(result)


def environment_at(study: Study, p: int) -> int:
    """Number of the environment that the film of place p is in."""
    load, film = study.probed.base.load_model, study.probed.places[p].film
    return next((f.environment for f in load.films if f.name == film), load.surroundings)


def _lasts(study: Study, windows: Sequence[Window]) -> bool:
    """Whether windows end with the last fitted run: the cause has come to stay."""
    last = study.runs[study.fitted[-1]].run
    end = last.drive.time[-1] - last.drive.time[0]
    return (
        any(w.run == last.name and w.end >= end - 1.0 for w in windows)
        and len(windows) > 0
        and all(w.level == 1.0 for w in windows)
    )


def slots_with(study: Study, elements: Elements, units: Sequence[Unit], k: int) -> Slots:
    """The slots of run k with these amplitudes, in their order. Raises ValueError for more than there are slots."""
    slots = study.slots(k)
    probed, load = study.probed, study.probed.base.load_model
    run = study.runs[k].run
    n = slots.gate.shape[0]
    if len(units) > slots.gate.shape[1]:
        raise ValueError("more amplitudes than slots")
    air = run.drive.environment - probed.base.reference_temperature
    films = [f.name for f in load.films]
    for s, unit in enumerate(units):
        shape = unit.shapes[k]
        fine = shape.reshape(n, INNER)
        coarse = fine.mean(axis=1)
        if unit.kind == "film":
            p = [q.name for q in probed.places].index(unit.place)
            slots.A[s], slots.M[s], slots.gate[:, s] = probed.A[p], probed.M[p], coarse
            slots.rise[:, :, s] = air[:, environment_at(study, p)].reshape(n, INNER)
        elif unit.kind == "wetted":  # a liquid keeps its temperature while the air's drifts: heat tells by how much
            p = [q.name for q in probed.places].index(unit.place)
            slots.A[s], slots.gate[:, s] = probed.A[p], coarse  # to the reference temperature: no rise
        elif unit.kind == "group_film":
            f = films.index(unit.place)
            slots.A[s] = np.asarray(probed.system.A[0])[f]
            slots.M[s], slots.gate[:, s] = np.asarray(probed.system.M)[:, f], coarse
            slots.rise[:, :, s] = air[:, load.films[f].environment].reshape(n, INNER)
        elif unit.kind == "group":
            slots.film[:, s, films.index(unit.place)] = coarse
        elif unit.kind == "air":
            slots.environment[:, :, s, [e.name for e in load.environments].index(unit.place)] = fine
        elif unit.kind == "joint":
            slots.joint[:, s, [j.name for j in load.joints].index(unit.place)] = coarse
        elif unit.kind == "contact":
            slots.contact[:, s, probed.base.load_model.contacts.index(unit.place)] = coarse
        elif unit.kind == "capacity":
            p = [q.name for q in probed.places].index(unit.place)
            slots.E[s] = np.outer(probed.B[p], probed.B[p])
        elif unit.kind == "heat":
            p = [q.name for q in probed.places].index(unit.place)
            slots.forcing[:, :, s] = fine[:, :, None] * probed.B[p]
        elif unit.kind == "moved":  # all that the source emits there, as warm as it is there
            name = unit.place.removeprefix("sources.").split(">")[0]
            vector = elements.vectors[k][elements.columns[unit.column].vector]
            j = [q.name for q in load.sources].index(name)
            slots.B[s][:, j] = vector
            if j in probed.layout.following_losses:  # mean temperature: what spreads heat over a surface, transposed
                slots.reads[s, probed.layout.following_losses.index(j)] = vector
        else:  # a forcing that the bank knows: history of its column, or of its blocks, times its vector
            column = elements.columns[unit.column]
            vector, history = elements.vectors[k][column.vector], column.histories[k]
            if unit.kind == "zone":
                history = shape
            if history is not None:
                flow = vector if vector.ndim == 2 else np.broadcast_to(vector, (len(shape), len(vector)))
                slots.forcing[:, :, s] = (flow * history[:, None]).reshape(n, INNER, -1)
    return slots
