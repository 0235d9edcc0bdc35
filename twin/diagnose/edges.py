"""When a windowed cause begins and ends, to the minute: blocks of an hour are for the search alone.

A cause of two hundred standard deviations whose window is off by a quarter of an hour leaves more misfit than most
other causes make. The derivative by an edge is the response to a pulse there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.acted import Unit, slots_with
from twin.diagnose.batch import Hypothesis
from twin.diagnose.diagnosis import Window
from twin.diagnose.elements import Elements
from twin.diagnose.march import Slots
from twin.diagnose.study import Study

PULSE = 600.0  # s
SHORTEST = 600.0  # s, of a window
PRIOR = 1800.0  # s: standard deviation of an edge about the hour that the search found
STEP = 1800.0  # s, the longest step of an edge


@dataclass(frozen=True)
class Edge:
    """One end of a window."""

    window: int
    end: bool


def edges_of(study: Study, h: Hypothesis) -> list[Edge]:
    """The edges of a hypothesis that lie within a run; none where windows are bells, or instants of a reading."""
    if h.family in ("sun", "not_thermal"):
        return []
    spans = {study.runs[k].run.name: _span(study, k) for k in study.fitted}
    result = []
    for i, w in enumerate(h.when.windows):
        if w.start > 0.0:
            result.append(Edge(i, False))
        if w.end < spans[w.run] - 1.0:
            result.append(Edge(i, True))
    return result


def moved(study: Study, h: Hypothesis, shifts: Sequence[tuple[Edge, float]]) -> Hypothesis:
    """The hypothesis with edges shifted [s]."""
    windows = list(h.when.windows)
    spans = {study.runs[k].run.name: _span(study, k) for k in study.fitted}
    for edge, by in shifts:
        w = windows[edge.window]
        if edge.end:
            windows[edge.window] = replace(w, end=float(np.clip(w.end + by, w.start + SHORTEST, spans[w.run])))
        else:
            windows[edge.window] = replace(w, start=float(np.clip(w.start + by, 0.0, w.end - SHORTEST)))
    return replace(h, when=replace(h.when, name=_named(windows, spans), windows=tuple(windows)))


def _named(windows: Sequence[Window], spans: dict[str, float]) -> str:
    first, runs = windows[0], [w.run for w in windows]
    lasting = all(w.end >= spans[w.run] - 1.0 for w in windows) and len(set(runs)) == len(runs)
    if lasting and len(windows) > 1 and all(w.start == 0.0 for w in windows[1:]):
        return f"from {first.start / 3600:.1f} h of {first.run} on"
    return "from " + " and ".join(f"{w.start / 3600:.1f} h to {w.end / 3600:.1f} h of {w.run}" for w in windows)


def with_pulses(
    study: Study, elements: Elements, h: Hypothesis, units: Sequence[Unit], a: np.ndarray, edges: Sequence[Edge], k: int
) -> Slots:
    """Slots of run k: the amplitudes, then per edge a pulse there that is 1 K, 1 W, ... times the amplitudes a."""
    slots = slots_with(study, elements, units, k)
    run = study.runs[k].run
    t = np.asarray(run.drive.time)
    for e, edge in enumerate(edges, start=len(units)):
        w = h.when.windows[edge.window]
        if w.run != run.name:
            continue
        at = w.end if edge.end else w.start
        shape = np.clip(np.minimum(t[1:], at + PULSE / 2) - np.maximum(t[:-1], at - PULSE / 2), 0.0, None)
        shape = shape / (t[1] - t[0])
        pulses = [replace(u, shapes=tuple(v * shape if i == k else s for i, s in enumerate(u.shapes)))
                  for u, v in zip(units, a, strict=True)]  # fmt: skip
        own = slots_with(study, elements, pulses, k)
        for q in range(len(units)):
            slots.A[e] += own.A[q]
            slots.M[e] += own.M[q]
            slots.gate[:, e] += own.gate[:, q]
            slots.rise[:, :, e] += own.rise[:, :, q]
            slots.forcing[:, :, e] += own.forcing[:, :, q]
            slots.film[:, e] += own.film[:, q]
            slots.joint[:, e] += own.joint[:, q]
            slots.contact[:, e] += own.contact[:, q]
            slots.environment[:, :, e] += own.environment[:, :, q]
    return slots


def per_second(edge: Edge) -> float:
    """The response to a shift of an edge by 1 s, in units of that to its pulse."""
    return (1.0 if edge.end else -1.0) / PULSE


def _span(study: Study, k: int) -> float:
    time = study.runs[k].run.drive.time
    return float(time[-1] - time[0])
