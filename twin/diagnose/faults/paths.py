"""Paths of heat that no search begins with: parts that the description does not join, joints that follow a speed.

There are as many as pairs of places: pairs of parts come first, each by its largest surface. Their columns, as those of
`elements`, are made when they are asked for.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from twin.diagnose.evidence.batch import Batch, History
from twin.diagnose.evidence.speeds import SPEEDS
from twin.diagnose.faults import joint, missing_joint
from twin.diagnose.faults.elements import conductances, conducted
from twin.diagnose.model.bank import Column, Nominal
from twin.diagnose.model.study import Study

STRONG = (10.0, 100.0)  # W/K, of a cable and of a flow of 3 l/min of oil: sizes at which a missing joint is scored


@dataclass(frozen=True)
class Paths:
    """Batches over columns behind all others, with what their responses are made from."""

    batches: tuple[Batch, ...]
    columns: tuple[Column, ...]
    vectors: tuple[tuple[np.ndarray, ...], ...]  # per fitted run: (r,) or (n, r) each


@dataclass
class _Made:
    """Paths as they are made, behind so many columns."""

    first: int
    runs: int  # of the study
    vectors: list[list[np.ndarray]]
    columns: list[Column] = field(default_factory=list)

    def add(
        self, of_run: Sequence[np.ndarray], acting: Sequence[Sequence[np.ndarray]], across: Sequence[float] = ()
    ) -> list[int]:
        """A vector per fitted run, as a column for each history, with what conducts beside it."""
        for own, vector in zip(self.vectors, of_run, strict=True):
            own.append(vector)
        begin, none, v = self.first + len(self.columns), (None,) * (self.runs - len(of_run)), len(self.vectors[0]) - 1
        beside = across or [0.0] * len(acting)
        self.columns.extend(Column(v, (*own, *none), across=k) for own, k in zip(acting, beside, strict=True))
        return list(range(begin, self.first + len(self.columns)))

    def paths(self, batches: Sequence[Batch]) -> Paths:
        return Paths(tuple(batches), tuple(self.columns), tuple(map(tuple, self.vectors)))


def paths_of(study: Study, nominal: Sequence[Nominal], first: int) -> Paths:
    """Between all parts that are not joined, and all joints with each speed; nominal: of the fitted runs, first: the
    number of the first column."""
    made = _Made(first, len(study.runs), [[] for _ in nominal])
    batches = _between(study, nominal, made, None)
    speeds = _speeds(study)
    for fault in joint.FAULTS:
        rows = []
        for name in (name for kind, name in conductances(study.probed.base.load_model) if kind == fault.kind):
            flow = [
                conducted(study, k, fault.kind, name, own.middle) for k, own in zip(study.fitted, nominal, strict=True)
            ]
            rows.append((name, made.add(flow, [values for _, values in speeds])))
        batches += fault.batches(rows, [when for when, _ in speeds])
    return made.paths(batches)


def paths_between(study: Study, nominal: Sequence[Nominal], first: int, parts: Collection[frozenset[str]]) -> Paths:
    """Between all surfaces of these parts, by two."""
    made = _Made(first, len(study.runs), [[] for _ in nominal])
    return made.paths(_between(study, nominal, made, parts))


def _between(
    study: Study, nominal: Sequence[Nominal], made: _Made, parts: Collection[frozenset[str]] | None
) -> list[Batch]:
    """Each pair by its derivative, and by what it does at some sizes: a strong one moves two bodies together, which the
    derivative of a weak one does not tell."""
    places, B, sizes = study.probed.places, study.probed.B, (0.0, *STRONG)
    rows = []
    for i, j in missing_joint.pairs(study, parts):
        d = B[i] - B[j]
        flow = [-(own.middle @ d) for own in nominal]
        columns = made.add([d for _ in nominal], [flow] * len(sizes), sizes)
        rows.append((f"{places[i].name}<>{places[j].name}", columns))
    always = [History("always", row[None]) for row in np.eye(len(sizes))]
    return [batch for fault in missing_joint.FAULTS for batch in fault.batches(rows, always)]


def _speeds(study: Study) -> list[tuple[History, list[np.ndarray]]]:
    """Logged speeds that are not nought throughout, as histories, each with its values in the fitted runs."""
    units = {s.name: s.unit for s in study.probed.base.load_model.signals}
    runs = [study.runs[k].run.signals for k in study.fitted]
    found = dict[str, tuple[float, list[np.ndarray]]]()
    for name in (n for n in runs[0] if units.get(n) in SPEEDS and all(n in of for of in runs)):
        values = [np.abs(of[name]) for of in runs]
        if (top := max(float(own.max(initial=0.0)) for own in values)) > 0.0:
            found[name] = top, [own / top for own in values]
    eye = np.eye(len(found))
    histories = [History(name, eye[[i]], name, 1.0, top) for i, (name, (top, _)) in enumerate(found.items())]
    return [(when, values) for when, (_, values) in zip(histories, found.values(), strict=True)]
