"""Where heat of any history enters, in blocks of five minutes: of parts that have evidence for it by the hour.

The responses are made when they are asked for: of every surface of a machine they would be gigabytes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.evidence.any_history import BLOCK, AnyHistory, any_history
from twin.diagnose.evidence.fitter import Fitted
from twin.diagnose.evidence.sight import Sight
from twin.diagnose.evidence.unknown import surfaces_of
from twin.diagnose.evidence.whiten import Projector
from twin.diagnose.faults.elements import blocks_of
from twin.diagnose.model.bank import Column, nominal_run, respond
from twin.diagnose.model.study import Study
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.exact import left_less, unbent
from twin.machine.effects.effect import Window


@dataclass(frozen=True)
class Entering:
    """Heat into a part."""

    part: str
    surface: str
    told: AnyHistory  # beside all others
    evidence: float  # beside those before it


def entering(
    detector: Detector, y: np.ndarray, fitted: Fitted, seen: Sight, parts: dict[str, float], places: int = 1,
    share: float | None = None,
) -> tuple[Entering, ...]:  # fmt: skip
    """Heat that a fit of measurements y (m,) leaves, at so many places at most; parts: evidence by the hour, of which
    the first are asked. None where no part has the evidence that heat needs. Where the fit has bent parameters, which
    then stand for some of the heat, it is told beside the description. share: of the first place's evidence, that a
    second one needs; by default what a name may lack of it, as no block is as short as a switch."""
    least, policy, study = detector.thresholds["unknown"], detector.policy, detector.study
    share = 1.0 - policy.covers if share is None else share
    if max(parts.values(), default=0.0) <= least:
        return ()
    ordered = sorted(parts, key=lambda p: -parts[p])[: policy.others]
    near = {p: surfaces_of(seen.heat, seen.g, p, 1.0 - policy.behind)[: policy.others] for p in ordered}
    asked = {p: names[0] for p, names in near.items()}
    of = _responses(detector, list(asked.values()))
    blocks = [(i, (a + b) / 2.0 * study.fitted_runs[i][1]) for i, a, b in heat_blocks(study)]
    there = unbent(detector, y, fitted)
    white, less = detector.whiten(there.residual), left_less(detector, there, fitted)

    def best_beside(others: Sequence[Entering], among: Iterable[str] = asked) -> Entering:
        projector = Projector.of(*there.projector.blocks, *(own.told.responses for own in others))
        known = {own.part for own in others}
        told = {p: any_history(of(asked[p]), blocks, projector, white) for p in among if p not in known}
        part = max(told, key=lambda p: told[p].evidence)
        if near[part][1:]:  # which of its surfaces an hour may not tell
            of_near = _responses(detector, near[part])
            of_each = {name: any_history(of_near(name), blocks, projector, white) for name in near[part]}
            near[part] = [max(of_each, key=lambda name: of_each[name].evidence)]
            asked[part], told[part] = near[part][0], of_each[near[part][0]]
        return Entering(part, asked[part], told[part], told[part].evidence - (0.0 if others else less))

    found = list[Entering]()
    while len(found) < min(places, len(asked)) and (best := best_beside(found)).evidence > least:
        found.append(best)
        least = max(least, share * found[0].evidence)
    if len(found) < 2:
        return tuple(found)
    first = best_beside(found[1:])  # which another part may have stood for
    if first.part != found[0].part:
        found = [best_beside((), (first.part,))]
        found.append(best_beside(found))
    first, second = found
    return replace(first, told=best_beside((second,), (first.part,)).told), second


def heat_blocks(study: Study) -> tuple[tuple[int, int, int], ...]:
    """(fitted run, first step, end) of the blocks that heat of any history is made of."""
    return blocks_of(study, BLOCK)


def switched_on(detector: Detector, own: Entering) -> tuple[Window, ...]:
    """In every run the window that heat tells best beside a linear trend: a fit without what switches has bent
    parameters, which drift."""
    study, blocks, windows = detector.study, heat_blocks(detector.study), list[Window]()
    for i, (name, step) in enumerate(study.fitted_runs):
        of_run = [b for b, (k, _, _) in enumerate(blocks) if k == i]
        first, end = step_of(own.told.heat[of_run])
        windows.append(Window(name, blocks[of_run[first]][1] * step, blocks[of_run[end - 1]][2] * step))
    return tuple(windows)


def step_of(heat: np.ndarray) -> tuple[int, int]:
    """First and end of the blocks in which heat (b,) differs most from a linear trend: of all windows the one that
    leaves least of it; of two halves of a run the one with more heat."""
    n = len(heat)
    line = np.linalg.qr(np.column_stack([np.ones(n), np.arange(n)]))[0]
    left = heat - line @ (line.T @ heat)
    sums = np.vstack([np.zeros(3), np.cumsum(np.column_stack([left, line]), axis=0)])
    within = sums[None, :] - sums[:, None]  # (first, end, 3)
    length = np.arange(n + 1)[None, :] - np.arange(n + 1)[:, None]
    beside = length - (within[..., 1:] ** 2).sum(axis=-1)  # of the window's square, beside the trend
    explained = np.where((length > 0) & (beside > 0.5), within[..., 0] ** 2 / np.maximum(beside, 0.5), 0.0)
    first, end = (int(k) for k in np.unravel_index(int(np.argmax(explained)), explained.shape))
    if within[first, end, 0] < 0.0 and (first == 0) != (end == n):
        first, end = (end, n) if first == 0 else (0, first)
    return first, end


def _responses(detector: Detector, surfaces: Sequence[str]) -> Callable[[str], np.ndarray]:
    """(m, b) white of each surface to 1 W in each block; those that are not known are made."""
    study, known = detector.study, detector.heated
    if missing := [s for s in surfaces if s not in known]:
        runs, blocks = study.runs, heat_blocks(study)
        gates = [_gate(runs[i].run.drive.n_steps, a, b) for i, a, b in blocks]
        of_blocks = [
            tuple(gate if k == i else None for k in range(len(runs)))
            for (i, _, _), gate in zip(blocks, gates, strict=True)
        ]
        columns = [Column(v, histories) for v in range(len(missing)) for histories in of_blocks]
        vectors = [[study.probed.B[_place(detector, s)] for s in missing]] * len(runs)
        nominal = [nominal_run(study, k) for k in study.fitted]
        made = respond(study, nominal, vectors, columns)
        known.update(zip(missing, np.split(made, len(missing), axis=1), strict=True))
    return lambda surface: detector.whiten(known[surface].astype(float))


def _gate(n: int, first: int, end: int) -> np.ndarray:
    gate = np.zeros(n)
    gate[first:end] = 1.0
    return gate


def _place(detector: Detector, surface: str) -> int:
    return next(i for i, p in enumerate(detector.study.probed.places) if p.name == surface)
