"""What moves the tool may be no part of the model: members that follow what is logged (docs/members.md).

Tried where displacements hold an effect that nothing in the catalogue explains, or a fault of their own reading alone.
Members are fitted beside the model as delivered, must halve what it leaves otherwise, must predict stretches that they
were not fitted to, and must not make sealed runs worse. The description gets them as nodes, beside the parts if any.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.calibrate.fit.measured import Measured
from twin.calibrate.members.describe import with_members
from twin.calibrate.members.find import Found, beside_model, left_by, rows_beside
from twin.calibrate.members.responses import duration
from twin.calibrate.members.select import SURE, Joined
from twin.diagnose.faults.missing_member import FAMILY
from twin.diagnose.model.study import COMPONENTS
from twin.diagnose.result.diagnosis import Cause, Gain
from twin.diagnose.result.numbers import rms
from twin.diagnose.search.gain import Channel, gain_of, predicted
from twin.diagnose.search.look import Search
from twin.errors import TwinError
from twin.logs.run import Run
from twin.machine.edit import edited
from twin.progress import Progress, silent
from twin.rom.artefact import Artefact


@dataclass(frozen=True)
class Missing:
    """Members that were found, and what they are worth."""

    causes: tuple[Cause, ...]  # the drivers that the data ask for strongly
    description: str  # machine.toml with all members; "" where it cannot say them
    gains: tuple[Gain, ...]  # of the displacements of sealed runs, in place of those of the search
    note: str


def missing_members(
    artefact: Artefact, found: Search, plans: Sequence[Measured], runs: Sequence[Run], sealed: Sequence[Run], seed: int,
    progress: Progress = silent,
) -> Missing | None:  # fmt: skip
    """None where there are no displacements, or no member earns its place. plans: measurements, of sealed runs last."""
    if sum(len(m.tcp) for m in plans[: len(runs)]) < found.detector.policy.rows:
        return None
    try:
        members = beside_model(artefact, runs, progress)
    except TwinError:  # nothing was logged that a body could follow
        return None
    selected, axes = members.selected, list(members.axes)
    explained = np.array([rms(_left(found, k, m)[:, axes]) for k, m in enumerate(plans[: len(runs)])])
    left, usual = rms(left_by(members, artefact, runs)), rms(explained)
    policy = found.detector.policy
    if not selected.named or _mean_ratio(left, usual) > policy.halves:
        return None
    if _mean_ratio(selected.held_out, selected.alone) > policy.predicts:
        return None
    gains = _gains(found, artefact, members, plans, runs, sealed, seed)
    worse, better = (sum(sign * g.ci95[i] > 0.0 for g in gains) for sign, i in ((-1.0, 1), (1.0, 0)))
    if worse > better:
        return None
    try:
        text = edited(artefact.description, members.expansions)
        text, told = with_members(text, members.members, selected.explained.scale, runs), ""
    except TwinError as e:
        text, told = "", e.problems[0].what
    causes = tuple(_cause(j, members) for j in selected.named)
    return Missing(causes, text, gains, _note(members, told))


def _cause(j: Joined, members: Found) -> Cause:
    at = int(np.argmax(j.moves))
    axis = members.axes[at]
    own = [m for m in members.members if m.candidate.driver.column == j.name]
    weight = np.array([abs(float(m.expansion[axis])) for m in own])
    lag = float(weight @ [m.candidate.lag for m in own] / max(float(weight.sum()), 1e-30))
    history = f"most along {COMPONENTS[axis]}, with a lag of {duration(lag)} in the mean"
    return Cause(
        family=FAMILY.name, place=f"signals.{j.name}", parameter="", amplitude=float(j.moves[at]),
        ci95=(float("nan"), float("nan")), unit="m", statistic=2.0 * j.gain, threshold=2.0 * SURE, history=history,
    )  # fmt: skip


def _note(members: Found, refused: str) -> str:
    s = members.selected
    figures = ", ".join(
        f"{COMPONENTS[a]} {1e6 * after:.2g} um in place of {1e6 * before:.2g} um"
        for a, before, after in zip(members.axes, s.alone, s.held_out, strict=True)
    )
    others = [j.name for j in s.joined if not j.sure]
    more = f"; {', '.join(others)} improve the prediction and are not named" if others else ""
    where = f"; not in the description: {refused}" if refused else ""
    return f"missing members: rms residual on data not used in their fit: {figures}{more}{where}"


def _left(found: Search, k: int, m: Measured, extended: bool = True) -> np.ndarray:
    """(k, 3) m that the recalibrated model leaves of run k, with the causes that were found or without."""
    own = predicted(found, k)
    return m.tcp - found.detector.study.runs[k].split(own.extended if extended else own.recalibrated)[1]


def _mean_ratio(after: np.ndarray, before: np.ndarray) -> float:
    return float(np.exp(np.mean(np.log(np.maximum(after, 1e-12) / np.maximum(before, 1e-12)))))


def _gains(
    found: Search, artefact: Artefact, members: Found, plans: Sequence[Measured], runs: Sequence[Run],
    sealed: Sequence[Run], seed: int,
) -> tuple[Gain, ...]:  # fmt: skip
    rng, policy, result = np.random.default_rng(seed), found.detector.policy, list[Gain]()
    for k, run in enumerate(sealed, start=len(runs)):
        m = plans[k]
        if not len(m.tcp):
            continue
        delivered, extended = errors_of(members, artefact, run)
        errors = [delivered, _left(found, k, m, extended=False), extended]
        result += [
            gain_of(Channel(m.name, COMPONENTS[c], "m", m.tcp_time, [e[:, c] for e in errors], True), rng, policy)
            for c in members.axes
        ]
    return tuple(result)


def errors_of(members: Found, artefact: Artefact, run: Run) -> tuple[np.ndarray, np.ndarray]:
    """(k, 3) m that the model alone and the model with its members leave of a run."""
    rows, F = rows_beside(artefact, [run], [m.candidate for m in members.members])
    a = np.nan_to_num(np.array([m.expansion for m in members.members]))  # (c, 3)
    return rows[0].y, rows[0].y - rows[0].J @ members.selected.explained.x - F[0] @ a
