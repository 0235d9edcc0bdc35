"""What families make their hypotheses from: columns, and histories as weights of these."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

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

    def rows(self, fault: Fault, history: str = "always") -> list[tuple[str, list[int]]]:
        """Places of a fault's kind, each with its column of a history."""
        return [(p, [c]) for p, h, c in self.named(fault.kind) if h == history]

    def blocks(self, fault: Fault) -> list[tuple[str, list[int]]]:
        """Places of a fault's kind, each with its columns of all blocks."""
        return [(p, c.tolist()) for (k, p), c in self.elements.block_of.items() if k == fault.kind]

    @property
    def outer(self) -> list[Place]:
        """Places with a film."""
        return [p for p in self.study.probed.places if p.film]


def single(context: Context, fault: Fault, largest: float | None = None) -> list[Batch]:
    """Every column of a kind a hypothesis of its own; a batch for each history."""
    names = dict.fromkeys(h for _, h, _ in context.named(fault.kind))
    return [
        batch for name in names
        for batch in fault.batches(context.rows(fault, name), (alone(context, name, fault.called),), largest)
    ]  # fmt: skip


@dataclass(frozen=True)
class Singly:
    """The batches of a family: every column of its faults a hypothesis of its own."""

    faults: tuple[Fault, ...]

    def __call__(self, context: Context) -> list[Batch]:
        return [batch for fault in self.faults for batch in single(context, fault)]


def alone(context: Context, name: str, called: str = "") -> History:
    """The history of one column, perhaps under another name."""
    return replace(logged(context, name, np.ones((1, 1))), name=called or name)


def logged(context: Context, name: str, weights: np.ndarray) -> History:
    signal, exponent, reference = context.elements.histories.unit.get(name, ("", 1.0, 1.0))
    return History(name, weights, signal, exponent, reference)


def logs(context: Context, names: Sequence[str], n: int) -> list[History]:
    """Histories of the first of n columns of a place."""
    return [logged(context, name, row[None]) for name, row in zip(names, np.eye(n), strict=False)]


def windows_of(context: Context) -> list[Stretch]:
    """Every stretch of hours within a run, and from every hour on to the end."""
    blocks, runs = context.elements.histories.blocks, context.study.fitted_runs
    own = [[b for b, (i, _, _) in enumerate(blocks) if i == r] for r in range(len(runs))]

    def part(r: int, first: int, last: int) -> tuple[np.ndarray, Window]:
        name, dt = runs[r]
        chosen = own[r][first : last + 1]
        weights = np.zeros(len(blocks))
        weights[chosen] = 1.0
        return weights, Window(name, blocks[chosen[0]][1] * dt, blocks[chosen[-1]][2] * dt)

    result: list[Stretch] = []
    for r, of_run in enumerate(own):
        n = len(of_run)
        for first in range(n):
            for last in range(first, n):
                weights, window = part(r, first, last)
                name = f"from {window.start / 3600:.1f} h to {window.end / 3600:.1f} h of {window.run}"
                result.append((name, weights, (window,)))
            if r + 1 < len(own):  # on for good
                parts = [part(r, first, n - 1), *(part(k, 0, len(own[k]) - 1) for k in range(r + 1, len(own)))]
                windows = tuple(window for _, window in parts)
                name = f"from {windows[0].start / 3600:.1f} h of {windows[0].run} on"
                result.append((name, np.sum([weights for weights, _ in parts], axis=0), windows))
    return result


def always(context: Context) -> Stretch:
    return "always", np.ones(len(context.elements.histories.blocks)), ()


def stretches(context: Context) -> list[Stretch]:
    """The windows beside "always": not the whole of all runs."""
    return [w for w in windows_of(context) if not w[1].all()]


def to_the_end(context: Context) -> list[Stretch]:
    """From an hour on: to the end of its run, or to that of the last one."""
    runs = [i for i, _, _ in context.elements.histories.blocks]
    ends = [b for b, (own, after) in enumerate(zip(runs, [*runs[1:], -1], strict=True)) if own != after]
    return [w for w in stretches(context) if np.flatnonzero(w[1])[-1] in ends]


def of_whole_runs(context: Context) -> list[Stretch]:
    """All of a run, or of it and all after it."""
    return [w for w in to_the_end(context) if all(window.start == 0.0 for window in w[2])]


def of_stretches(found: Sequence[Stretch], before: int = 0) -> list[History]:
    """Histories of stretches, whose blocks come after some columns of a place."""
    return [History(name, np.pad(w, (before, 0))[None], windows=windows) for name, w, windows in found]


def most_heat(context: Context) -> float:
    """W: what no undescribed source can exceed, all that the machine is said to turn into heat at once in any run."""
    most = CABINET
    for k in context.study.fitted:
        drive = context.study.runs[k].run.drive
        total = drive.power.sum(axis=1) + np.abs(drive.port_heat).sum(axis=1)
        if drive.losses.index:
            total = total + drive.losses.value.max(axis=2).sum(axis=1)
        most = max(most, float(total.max(initial=0.0)))
    return most
