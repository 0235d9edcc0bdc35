"""What families make their hypotheses from: columns, and histories as weights of these."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.build.places import Place
from twin.diagnose.evidence.batch import Batch, History
from twin.diagnose.faults.elements import Elements
from twin.diagnose.faults.fault import Fault
from twin.diagnose.model.study import Study
from twin.machine.effects.effect import Window

CABINET = 500.0  # W: what a cabinet or a hydraulic unit beside a machine without described losses gives off

Stretch = tuple[str, np.ndarray, tuple[Window, ...]]  # name, weights of the blocks, windows


@dataclass(frozen=True)
class Context:
    """What families make their hypotheses from."""

    study: Study
    elements: Elements
    index: dict[tuple[str, str, str], int]  # of all columns: elements first, readings after them

    def named(self, kind: str) -> list[tuple[str, str, int]]:
        """(place, history, column) of a kind."""
        return [(p, h, c) for (k, p, h), c in self.index.items() if k == kind]

    @property
    def outer(self) -> list[Place]:
        """Places with a film."""
        return [p for p in self.study.probed.places if p.film]


def single(context: Context, fault: Fault) -> list[Batch]:
    """Every column of a kind a hypothesis of its own."""
    found = context.named(fault.kind)
    return [fault.batch([(p, [c]) for p, h, c in found if h == name], (alone(context, name),))
            for name in dict.fromkeys(h for _, h, _ in found)]  # fmt: skip


def called(context: Context, fault: Fault, history: str) -> list[Batch]:
    """Hypotheses of a kind of one history, under another name; none where there is no column."""
    rows = [(p, [c]) for p, _, c in context.named(fault.kind)]
    return [fault.batch(rows, (History(history, np.ones((1, 1))),))] if rows else []


def alone(context: Context, name: str) -> History:
    """The history of one column."""
    return logged(context, name, np.ones((1, 1)))


def logged(context: Context, name: str, weights: np.ndarray) -> History:
    signal, exponent, reference = context.elements.histories.unit.get(name, ("", 1.0, 1.0))
    return History(name, weights, signal, exponent, reference)


def windows_of(context: Context) -> list[Stretch]:
    """Every stretch of hours within a run, and from every hour on to the end."""
    blocks = context.elements.histories.blocks
    study = context.study
    runs = [study.runs[k].run for k in study.fitted]
    own = [[b for b, (i, _, _) in enumerate(blocks) if i == r] for r in range(len(runs))]

    def part(r: int, first: int, last: int) -> tuple[np.ndarray, Window]:
        dt = runs[r].drive.time[1] - runs[r].drive.time[0]
        chosen = own[r][first : last + 1]
        weights = np.zeros(len(blocks))
        weights[chosen] = 1.0
        return weights, Window(runs[r].name, blocks[chosen[0]][1] * dt, blocks[chosen[-1]][2] * dt)

    result: list[Stretch] = []
    for r, of_run in enumerate(own):
        n = len(of_run)
        for first in range(n):
            for last in range(first, n):
                weights, window = part(r, first, last)
                name = f"from {window.start / 3600:.1f} h to {window.end / 3600:.1f} h of {window.run}"
                result.append((name, weights, (window,)))
            if r + 1 < len(own):  # on for good
                weights, window = part(r, first, n - 1)
                windows = [window]
                for later in range(r + 1, len(own)):
                    more, rest = part(later, 0, len(own[later]) - 1)
                    weights, windows = weights + more, [*windows, rest]
                result.append((f"from {window.start / 3600:.1f} h of {window.run} on", weights, tuple(windows)))
    return result


def always(context: Context) -> Stretch:
    return "always", np.ones(len(context.elements.histories.blocks)), ()


def stretches(context: Context) -> list[Stretch]:
    """The windows beside "always": not the whole of all runs."""
    return [w for w in windows_of(context) if not w[1].all()]


def lasting(context: Context) -> list[Stretch]:
    """From an hour on: to the end of the last run."""
    last = context.study.runs[context.study.fitted[-1]].run.name
    n = len(context.elements.histories.blocks)
    return [w for w in stretches(context) if w[1][n - 1] == 1.0 and w[2][-1].run == last]


def of_stretches(found: Sequence[Stretch]) -> list[History]:
    return [History(name, w[None], windows=windows) for name, w, windows in found]


def wide(one: np.ndarray, at: int, length: int) -> np.ndarray:
    """(length,) weights `one` from a column on, zero elsewhere."""
    result = np.zeros(length)
    result[at : at + len(one)] = one
    return result


def most_heat(context: Context) -> float:
    """W: what no undescribed source can exceed, all that the machine is said to turn into heat at once in any run."""
    most = 0.0
    for k in context.study.fitted:
        drive = context.study.runs[k].run.drive
        total = drive.power.sum(axis=1) + np.abs(drive.port_heat).sum(axis=1)
        if drive.losses.index:
            total = total + drive.losses.value.max(axis=2).sum(axis=1)
        most = max(most, float(total.max(initial=0.0)))
    return max(most, CABINET)
