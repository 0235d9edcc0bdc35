"""Paths of heat that are asked after all else: two parts that the description does not join, and joints whose
conductance follows a speed.

They do what other causes do, nearly: an oil line from a warm motor to a bed is heat there with the motor's power, or
the motor's heat elsewhere; a joint that conducts more while a spindle turns is a loss that falls with its own
temperature; and at a part that shows what two causes do, a sensor is at fault. There are as many as pairs of places,
and would raise the threshold of everything. So where a search has found anything, heat of any history, or a number out
of its tolerance, or leaves more than noise does, one path must explain clearly more than all of that together, and
takes its place; where it explains as much it is its rival. Another machine is not asked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.fitter import Fitted
from twin.diagnose.faults.paths import Paths, paths_between, paths_of
from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.bank import Nominal, nominal_run, respond
from twin.diagnose.result.spot import Spot
from twin.diagnose.search.accepted import Accepted, as_scored, exchanged, possible, readings_columns
from twin.diagnose.search.contest import worth
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.exact import closer, exact, left_less, misfit, unbent
from twin.diagnose.search.forward import naming, stands, uneven
from twin.diagnose.search.look import Search, with_cosines
from twin.diagnose.search.refit import refit


def otherwise(found: Search, y: np.ndarray, more: bool = False) -> Search:
    """A search in y (m,), or what it is where one path of heat explains more than all that it has found, or than all
    but faults of readings; with that path among the rivals where it explains as much. more: whether it leaves more than
    noise and model discrepancy do, though it has found nothing."""
    if not (found.accepted or found.loose or more or _heat(found)):
        return found
    study, first = found.detector.study, found.detector.columns.raw.shape[1]
    nominal = [nominal_run(study, k) for k in study.fitted]
    detector, paths = _with(found.detector, nominal, paths_of(study, nominal, first))
    paths = [h for h in paths if h.family in detector.thresholds]
    if not paths:
        return found
    beside = [a for a in found.accepted if fault_of(a.hypothesis).read]
    told = list[_Told]()
    for others in (beside, []) if beside and (_heat(found) or len(beside) < len(found.accepted)) else ([],):
        told += _instead(found, detector, y, nominal, paths, others)
    return max(told, key=lambda one: (one.instead, one.gained), default=_Told(found, False, 0.0)).search


@dataclass(frozen=True)
class _Told:
    """A search with a path."""

    search: Search
    instead: bool  # in place of what was found, not a rival
    gained: float  # misfit that is removed


def _heat(found: Search) -> float:
    """The evidence for heat of any history that a search has left, 0 where it does not pass."""
    left = max(found.steps[-1].parts.values(), default=0.0)
    return left if left > found.detector.thresholds["unknown"] else 0.0


def _instead(
    found: Search, detector: Detector, y: np.ndarray, nominal: Sequence[Nominal], paths: Sequence[Hypothesis],
    others: Sequence[Accepted],
) -> list[_Told]:  # fmt: skip
    """The best path beside some other causes in place of the rest that a search has found, or among its rivals; none
    where it explains less."""
    policy, heat = detector.policy, _heat(found)
    start = detector.fitter(y)
    fitted, kept = refit(detector, y, found.fitted.x, others) if others else (start, [])
    rest = exchanged(detector.study, y, kept)
    detector, likely = _nearer(detector, rest, fitted, nominal, _likely(detector, rest, fitted, paths))
    passes = policy.window_passes  # a strong path is far from where the derivative of a weak one points
    tried = [exact(detector, rest, fitted, h, passes) for h in likely]
    tried = [h for h in tried if _possible(detector, h, h.amplitude[0])]
    replaced = [a for a in found.accepted if all(a is not own for own in others)]
    removed = max(misfit(detector, fitted) - misfit(detector, found.fitted), 0.0)
    strongest = max((a.statistic for a in replaced), default=0.0)
    explained = max(removed, strongest)
    best = max(tried, key=lambda h: worth(h, policy), default=None)
    if best is None or best.statistic < (1.0 - policy.saturates) * (explained + heat):
        return []
    near = [h for h in tried if h is not best and h.statistic > best.statistic - policy.rival]
    best = closer(detector, rest, fitted, best)
    one = as_scored(detector.study, best, detector.thresholds[best.family])
    one = replace(one, rivals=with_cosines(detector, fitted, best, near))
    now = naming(replace(found, detector=detector), y, fitted.x, [one, *(replace(a, rivals=()) for a in kept)])
    path, *kept = now.accepted
    stand = _possible(detector, best, float(path.amplitude[0])) and all(stands(detector, a) for a in kept)
    if not stand or uneven(detector, now.accepted):
        return []
    price = best.statistic - worth(best, policy)
    freedom = sum(a.hypothesis.statistic - worth(a.hypothesis, policy) for a in replaced)
    gained = misfit(detector, fitted) - misfit(detector, now.fitted) - price
    # refitted with all, and as candidates are compared: far from linear the two differ by more than chance
    more = gained - removed, worth(best, policy) - strongest
    margin = max(policy.close, policy.misfit * explained)
    covers = not heat or (gained > policy.covers * (explained + heat) and _heat(now) <= _misfits(now, gained))
    if gained <= one.threshold or not covers:
        return []
    if min(more) > margin:
        return [_Told(now, True, misfit(detector, start) - misfit(detector, now.fitted) - price)]
    if heat or not replaced or max(more) + freedom <= -margin:
        return []
    lead = next((a for a in replaced if not fault_of(a.hypothesis).read), replaced[0])
    best = replace(best, statistic=max(best.statistic, gained + price))
    rivals = (*lead.rivals, *with_cosines(detector, fitted, lead.hypothesis, [best]))
    accepted = tuple(replace(a, rivals=rivals) if a is lead else a for a in found.accepted)
    return [_Told(replace(found, detector=detector, accepted=accepted), False, gained)]


def _possible(detector: Detector, h: Hypothesis, size: float) -> bool:
    """Whether a path of a size is worth a name, and physics allows it."""
    return abs(size) >= detector.policy.stands * h.batch.smallest and possible(detector, h, size)


def _misfits(now: Search, explained: float) -> float:
    """Heat that a path may leave because the model is not the machine."""
    return max(now.detector.thresholds["unknown"], now.detector.policy.misfit * explained)


def _nearer(
    detector: Detector, y: np.ndarray, fitted: Fitted, nominal: Sequence[Nominal], likely: Sequence[Hypothesis]
) -> tuple[Detector, list[Hypothesis]]:
    """The most likely paths, those between parts of several surfaces at the best of these."""
    spots = [Spot.read(h.name) for h in likely]
    parts = {frozenset((s.part, Spot.read(s.partner).part)) for s in spots if s.between}
    own = paths_between(detector.study, nominal, detector.columns.raw.shape[1], parts)
    if sum(len(b.places) for b in own.batches) <= len(parts):
        return detector, list(likely)
    detector, between = _with(detector, nominal, own)
    joints = [h for h, s in zip(likely, spots, strict=True) if not s.between]
    return detector, _likely(detector, y, fitted, [*joints, *between])


def _with(detector: Detector, nominal: Sequence[Nominal], own: Paths) -> tuple[Detector, list[Hypothesis]]:
    """The detector with columns of paths behind all others, and each path as a hypothesis, not scored yet."""
    known = detector.columns
    raw = detector.whiten(respond(detector.study, nominal, own.vectors, own.columns).astype(float))
    others = np.hstack([known.others, detector.fitter.others.T @ raw])
    columns = replace(known, raw=np.hstack([known.raw, raw.astype(np.float32)]), others=others)
    found = [Hypothesis(b, i, w, 0.0, (0.0,)) for b in own.batches for i in range(len(b.places)) for w in b.histories]
    return replace(detector, columns=columns), found


def _likely(detector: Detector, y: np.ndarray, fitted: Fitted, paths: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The paths that explain most by their scores, as many as others of a kind are refitted."""
    there = unbent(detector, y, fitted)
    less, white = left_less(detector, there, fitted), detector.whiten(there.residual)
    D = np.column_stack([readings_columns(detector, h) for h in paths])
    PD = there.projector(D)
    g, F = PD.T @ white, np.maximum((D * PD).sum(axis=0), 1e-30)
    scored = [
        replace(h, statistic=float(a * own - less), amplitude=(float(a),))
        for h, a, own in zip(paths, g / F, g, strict=True) if h.batch.sign == 0 or h.batch.sign * a > 0.0
    ]  # fmt: skip
    best = dict[tuple[str, str, str], Hypothesis]()
    for h in sorted(scored, key=lambda h: -h.statistic):
        best.setdefault((h.family, h.name, h.when.signal), h)
    return [h for h in list(best.values())[: detector.policy.entrants] if h.statistic > 0.0]
