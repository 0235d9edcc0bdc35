"""Members found in measured runs: beside a model whose expansions are refitted, or without any model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.calibrate.fit.options import Options
from twin.calibrate.fit.problem import Problem, problem
from twin.calibrate.members.describe import Member
from twin.calibrate.members.driver import drivers_of
from twin.calibrate.members.evidence import EVERY, Sums
from twin.calibrate.members.responses import Candidate, candidates, responses
from twin.calibrate.members.select import Selected, select
from twin.errors import LogError
from twin.logs.run import Run
from twin.progress import Progress, silent
from twin.rom.artefact import Artefact

STRETCHES = 3  # at least: runs, or equal parts of them


@dataclass(frozen=True)
class Rows:
    """TCP rows of a run, EVERY apart; k rows, n expansions of the model."""

    time: np.ndarray  # (k,) s
    y: np.ndarray  # (k, 3) m, measured less computed, NaN along axes that were not measured
    J: np.ndarray  # (k, 3, n) m per prior standard deviation


@dataclass(frozen=True)
class Found:
    """What was found: `members` of all drivers, and how the expansions of the model change with them."""

    members: tuple[Member, ...]
    selected: Selected
    axes: tuple[int, ...]  # of dx, dy, dz: those that were measured
    expansions: dict[str, float]  # SI, by path, of the model's own


def beside_model(artefact: Artefact, runs: Sequence[Run], progress: Progress = silent) -> Found:
    """Members beside a model as it was delivered: temperatures stay, expansions are fitted beside the members.

    Displacements say little about temperatures, and a calibration drags capacities and losses after what is missing.
    Raises LogError for runs without displacements or without anything to follow.
    """
    made, rows = _rows_beside(artefact, runs)
    members, selected, axes = _found(runs, rows, progress)
    return Found(members, selected, axes, _values(made, selected.explained.x))


def rows_beside(
    artefact: Artefact, runs: Sequence[Run], members: Sequence[Candidate]
) -> tuple[list[Rows], list[np.ndarray]]:
    """Per run what the model as delivered leaves of every TCP row, and what members do there (k, c) [K]."""
    _, rows = _rows_beside(artefact, runs)
    return rows, [responses(run, members, r.time) for run, r in zip(runs, rows, strict=True)]


def left_by(found: Found, artefact: Artefact, runs: Sequence[Run]) -> np.ndarray:
    """(runs, m) m: rms that the model with its members leaves of each run, per measured axis."""
    rows, F = rows_beside(artefact, runs, [m.candidate for m in found.members])
    a = np.nan_to_num(np.array([m.expansion for m in found.members]))
    errors = [r.y - r.J @ found.selected.explained.x - f @ a for r, f in zip(rows, F, strict=True)]
    return np.array([np.sqrt(np.nanmean(e[:, list(found.axes)] ** 2, axis=0)) for e in errors if len(e)])


def _rows_beside(artefact: Artefact, runs: Sequence[Run]) -> tuple[Problem, list[Rows]]:
    own = [p for p in artefact.parameters if p.kind == "expansion"]
    made = problem(artefact, runs, own, Options())
    x = np.zeros(len(made.scale))
    n = len(own)  # corrections of initial states come after them: none, for what was stated is taken
    return made, [
        Rows(r.measured.tcp_time, r.measured.tcp - w, J[:, :, :n])
        for r, (_, w), (_, J) in zip(made.runs, made.outputs(x), made.jacobian(x), strict=True)
    ]


def without_model(runs: Sequence[Run], progress: Progress = silent) -> Found:
    """Members alone: a network from a log. Displacements count from the first row of each run."""
    rows = []
    for run in runs:
        if run.tcp is None or not len(run.tcp.time):
            raise LogError(
                "no displacements", str(run.folder), "a network from a log needs tcp.csv: time and dx, dy or dz"
            )
        good = np.isfinite(run.tcp.displacement).any(axis=1)
        y = run.tcp.displacement[good] - run.tcp.displacement[good][0]
        rows.append(Rows(run.tcp.time[good], y, np.zeros((int(good.sum()), 3, 0))))
    members, selected, axes = _found(runs, rows, progress)
    return Found(members, selected, axes, {})


def _found(
    runs: Sequence[Run], rows: Sequence[Rows], progress: Progress
) -> tuple[tuple[Member, ...], Selected, tuple[int, ...]]:
    tried = candidates(drivers_of(runs))
    if not tried:
        raise LogError(
            "nothing to follow", str(runs[0].folder), "log temperatures, speeds or powers beside the displacements"
        )
    groups: dict[str, list[int]] = {}
    for k, candidate in enumerate(tried):
        groups.setdefault(candidate.driver.column, []).append(k)
    rows = [Rows(r.time[k], r.y[k], r.J[k]) for r in rows for k in [thinned(r.time)]]
    if sum(len(r.time) for r in rows) == 0:
        raise LogError("no displacements", str(runs[0].folder), "give tcp.csv with dx, dy or dz")
    measured = np.isfinite(np.concatenate([r.y for r in rows])).any(axis=0)
    axes = tuple(int(a) for a in np.flatnonzero(measured))
    parts = -(-STRETCHES // len(runs))
    stretches = []
    for run, r in zip(runs, rows, strict=True):
        F = responses(run, tried, r.time)
        part = np.minimum((parts * (r.time - r.time[0]) / max(np.ptp(r.time), 1e-9)).astype(int), parts - 1)
        stretches += [
            Sums.of(r.y[part == k][:, axes], r.J[part == k][:, axes], F[part == k])
            for k in range(parts)
            if (part == k).any()
        ]
    if len(stretches) < 2:
        raise LogError(
            "too few displacements", str(runs[0].folder), f"give rows over some hours, {EVERY / 60:g} min apart"
        )
    selected = select(stretches, groups, progress)
    members = []
    for at, k in enumerate(selected.explained.chosen):
        expansion = np.full(3, np.nan)
        expansion[list(axes)] = selected.explained.a[:, at]
        members.append(Member(tried[k], expansion))
    return tuple(members), selected, axes


def thinned(time: np.ndarray) -> np.ndarray:
    """Indices of the first row of every EVERY seconds."""
    if not len(time):
        return np.zeros(0, dtype=int)
    return np.unique(np.floor((time - time[0]) / EVERY + 1e-9), return_index=True)[1]


def _values(made: Problem, x: np.ndarray) -> dict[str, float]:
    return {p.path: p.value(float(c)) for p, c in zip(made.parameters, x, strict=True)}
