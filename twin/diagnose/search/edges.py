"""When a cause begins and ends, to the minute, and the course of the sun: blocks of an hour are for the search alone.

A strong cause whose window is off by a quarter of an hour leaves more misfit than most other causes make. The
derivative by an edge is the response to a pulse there; by the centre or length of a bell, to the difference of two
bells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from twin.diagnose.evidence import bells
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.faults.acted import slots_with
from twin.diagnose.faults.elements import Elements
from twin.diagnose.faults.fault import Unit
from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.slots import Slots
from twin.diagnose.model.study import Study
from twin.diagnose.result.diagnosis import Window
from twin.diagnose.search.policy import SearchPolicy

PULSE = 600.0  # s
SHORTEST = 600.0  # s, of a window
BRIEF = 7200.0  # s, the shortest bell


@dataclass(frozen=True)
class Edge:
    """One end of a window, or what a bell is made of."""

    what: Literal["begin", "end", "centre", "length"]
    window: int = 0

    @property
    def per_second(self) -> float:
        """The response to a shift by 1 s, in units of that to its pulse."""
        return (-1.0 if self.what == "begin" else 1.0) / PULSE

    def prior(self, policy: SearchPolicy) -> float:
        """Standard deviation [s] about what the search found."""
        return 2.0 * policy.edge_prior if self.what == "length" else policy.edge_prior


def edges_of(study: Study, h: Hypothesis) -> list[Edge]:
    """The edges of a hypothesis that may move, those of a bell; none of a reading.

    What was there before a run and stays, or lasts beyond its end, has no edge there.
    """
    if fault_of(h).read or not (h.when.windows or h.when.bell):
        return []
    if h.when.bell is not None:
        return [*(Edge("centre", i) for i in range(len(h.when.bell.centres))), Edge("length")]
    spans = _spans(study)
    windows = h.when.windows
    whole = [w.end >= spans[w.run] - 1.0 for w in windows]
    result = []
    for i, w in enumerate(windows):
        lasts = whole[i] and (w.start == 0.0 or i + 1 == len(windows) or windows[i + 1].start == 0.0)
        begun = w.start == 0.0 and (whole[i] or (i > 0 and whole[i - 1]))
        if not begun:  # what begins with a run may begin some minutes later
            result.append(Edge("begin", i))
        if not lasts:
            result.append(Edge("end", i))
    return result


def moved(study: Study, elements: Elements, h: Hypothesis, shifts: Sequence[tuple[Edge, float]]) -> Hypothesis:
    """The hypothesis with edges shifted [s]."""
    if (bell := h.when.bell) is not None:
        by = dict(shifts)
        centres = tuple(c + by.get(Edge("centre", i), 0.0) for i, c in enumerate(bell.centres))
        bell = bells.Bell(centres, max(bell.length + by.get(Edge("length"), 0.0), BRIEF))
        weights, windows = bells.by_blocks(study.fitted_runs, elements.histories.blocks, bell)
        words = bells.name(bell, study.fitted_runs)
        return replace(h, when=replace(h.when, name=words, weights=weights, windows=windows, bell=bell))
    ends = list(h.when.windows)
    spans = _spans(study)
    for edge, shift in shifts:
        w = ends[edge.window]
        if edge.what == "end":
            ends[edge.window] = replace(w, end=float(np.clip(w.end + shift, w.start + SHORTEST, spans[w.run])))
        else:
            ends[edge.window] = replace(w, start=float(np.clip(w.start + shift, 0.0, w.end - SHORTEST)))
    return in_windows(h, ends, spans)


def longer(study: Study, elements: Elements, h: Hypothesis) -> Hypothesis:
    """The hypothesis in windows twice as long, as far as the next one and the run's end let them; h itself where none
    can be."""
    windows, shifts = h.when.windows, list[tuple[Edge, float]]()
    for edge in edges_of(study, h):
        if edge.what == "end":
            w, later = windows[edge.window], windows[edge.window + 1 :]
            room = min((o.start - w.end - SHORTEST for o in later if o.run == w.run), default=np.inf)
            shifts.append((edge, max(min(w.end - w.start, room), 0.0)))
    return moved(study, elements, h, shifts) if any(by > 0.0 for _, by in shifts) else h


def without_one(study: Study, h: Hypothesis) -> list[Hypothesis]:
    """The hypothesis without each of its windows in turn; none where it has a single one."""
    windows, spans = h.when.windows, _spans(study)
    fewer = [(*windows[:i], *windows[i + 1 :]) for i in range(len(windows) if len(windows) > 1 else 0)]
    return [in_windows(h, left, spans) for left in fewer]


def shorter(study: Study, h: Hypothesis) -> list[Hypothesis]:
    """The hypothesis with one half of each of its windows in turn: what ends with a run stays there otherwise."""
    windows, spans, result = h.when.windows, _spans(study), list[Hypothesis]()
    for i, w in enumerate(windows):
        middle = 0.5 * (w.start + w.end)
        halves = (replace(w, end=middle), replace(w, start=middle)) if w.end - w.start > 2.0 * SHORTEST else ()
        result += [in_windows(h, (*windows[:i], half, *windows[i + 1 :]), spans) for half in halves]
    return result


def in_windows(h: Hypothesis, windows: Sequence[Window], spans: dict[str, float]) -> Hypothesis:
    """The hypothesis in other windows, which its name tells; spans: when every run ends [s]."""
    first, runs = windows[0], [w.run for w in windows]
    lasting = all(w.end >= spans[w.run] - 1.0 for w in windows) and len(set(runs)) == len(runs)
    name = "from " + " and ".join(f"{w.start / 3600:.1f} h to {w.end / 3600:.1f} h of {w.run}" for w in windows)
    if lasting and len(windows) > 1 and all(w.start == 0.0 for w in windows[1:]):
        name = f"from {first.start / 3600:.1f} h of {first.run} on"
    return replace(h, when=replace(h.when, name=name, windows=tuple(windows)))


def with_pulses(
    study: Study, elements: Elements, h: Hypothesis, units: Sequence[Unit], a: np.ndarray, edges: Sequence[Edge], k: int
) -> Slots:
    """Slots of run k: the amplitudes, then per edge a pulse there that is 1 K, 1 W, ... times the amplitudes a."""
    slots = slots_with(study, elements, units, k)
    for e, edge in enumerate(edges, start=len(units)):
        pulse, pulses = _pulse(study, h, edge, k), []
        if not pulse.any():
            continue
        for u, v in zip(units, a, strict=True):  # a bell has an amplitude for each run, which acts in that run alone
            own = pulse if u.shapes[k].any() else np.zeros(len(pulse))
            pulses.append(replace(u, shapes=tuple(v * own if i == k else s for i, s in enumerate(u.shapes))))
        made = slots_with(study, elements, pulses, k)
        slots.A[e] += made.A.sum(axis=0)
        slots.M[e] += made.M.sum(axis=0)
        for name in ("gate", "film", "joint", "contact", "rise", "forcing", "environment"):
            getattr(slots, name)[:, e] += getattr(made, name).sum(axis=1)
    return slots


def shape_errors(study: Study, h: Hypothesis, units: Sequence[Unit], a: np.ndarray, policy: SearchPolicy) -> list[Unit]:
    """Units whose responses at amplitude one are what the shape of a cause leaves open, one standard deviation each."""
    if (own := fault_of(h).left_open(units, a)) is not None:
        return own
    if (bell := h.when.bell) is not None:
        changes = []
        for k in range(len(study.runs)):
            t = np.asarray(study.runs[k].run.drive.time)
            middle, centre = (t[:-1] + t[1:]) / 2, bell.centres[study.fitted.index(k)] if k in study.fitted else 0.0
            longer, shorter = (bells.level(middle, centre, bell.length + by) for by in (policy.longer, 0.0))
            changes.append(longer - shorter)
        return [
            replace(u, shapes=tuple(v * c * s.any() for c, s in zip(changes, u.shapes, strict=True)))
            for u, v in zip(units, a, strict=True)
        ]
    if h.when.windows:
        runs, edges = range(len(study.runs)), edges_of(study, h)
        wide = [[e.prior(policy) / PULSE * _pulse(study, h, e, k) for k in runs] for e in edges]
        return [replace(u, shapes=tuple(v * s for s in own)) for own in wide for u, v in zip(units, a, strict=True)]
    if not h.when.signal or h.when.exponent == 0.0:
        return []
    by = policy.exponent / h.when.exponent  # d(s^e) / de = s^e ln s = (s^e ln s^e) / e
    return [
        replace(u, shapes=tuple(v * by * s * np.log(np.maximum(s, 1e-12)) for s in u.shapes))
        for u, v in zip(units, a, strict=True)
    ]


def _pulse(study: Study, h: Hypothesis, edge: Edge, k: int) -> np.ndarray:
    """(n,) the change of a shape in run k while an edge moves by PULSE; zero in other runs."""
    run, by = study.runs[k].run, PULSE / 2
    t = np.asarray(run.drive.time)
    if (bell := h.when.bell) is not None:
        i, centre = study.fitted.index(k), edge.what == "centre"
        if centre and edge.window != i:
            return np.zeros(len(t) - 1)
        middle, moves = (t[:-1] + t[1:]) / 2, ((by, 0.0), (-by, 0.0)) if centre else ((0.0, by), (0.0, -by))
        later, sooner = (bells.level(middle, bell.centres[i] + c, bell.length + d) for c, d in moves)
        return later - sooner
    w = h.when.windows[edge.window]
    if w.run != run.name:
        return np.zeros(len(t) - 1)
    at = w.end if edge.what == "end" else w.start
    shape = np.clip(np.minimum(t[1:], at + by) - np.maximum(t[:-1], at - by), 0.0, None)
    return np.asarray(shape / (t[1] - t[0]))


def _spans(study: Study) -> dict[str, float]:
    """How long every fitted run is [s]."""
    runs = [study.runs[k].run for k in study.fitted]
    return {run.name: float(run.drive.time[-1] - run.drive.time[0]) for run in runs}
