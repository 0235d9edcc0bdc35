"""Forward selection: name the best cause, refit everything exactly, look again, until nothing passes its threshold.

Every refit may show that a cause was a stopgap for another: what no longer explains half its threshold, or has become
too small to name or negative, is dropped and not looked at again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.consistency import differs
from twin.diagnose.evidence.fitter import Fitted
from twin.diagnose.evidence.sight import Sight
from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.study import K, Study
from twin.diagnose.search.accepted import Accepted, as_scored, exchanged, possible, settled, strong
from twin.diagnose.search.any_heat import Entering, entering, switched_on
from twin.diagnose.search.companions import Limit, limits_beside, parts_of, surfaces_of_place
from twin.diagnose.search.contest import behind, bent, foremost, judged, proof, tried, worth
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.exact import beginning, misfit
from twin.diagnose.search.growth import between, chilled, grown, within
from twin.diagnose.search.hotter import hotter
from twin.diagnose.search.look import Search, Step, distinct, look, other_drives, with_cosines
from twin.diagnose.search.loose import loose_ones
from twin.diagnose.search.policy import SearchPolicy
from twin.diagnose.search.refit import refit
from twin.diagnose.search.start import Alone, Start, afresh, begun
from twin.diagnose.search.strained import closed, strained


def search(described: Detector, y: np.ndarray, start: Start | None = None) -> Search:
    """Causes in measurements y (m,) of the fitted runs, NaN where something is missing; start: `begun` with them."""
    start = start or begun(afresh(described), y)
    return _one_number(start, y) or _forward(described, y, start)


def search_again(described: Detector, y: np.ndarray, start: Start, first: Search, least: float) -> Search:
    """What a first search has found where causes must explain more than `least`, from fits that are known. Anew it is
    searched only where one of them no longer does: what remains might not have been named without it."""
    fewer = start.detector.at_least(least)
    start = replace(start, detector=fewer, loose=loose_ones(fewer, y, start.fitted, start.x0, start.freed))
    if ended := _one_number(start, y):
        return ended
    named = sorted(first.accepted, key=lambda a: -a.statistic)
    beside = limits_beside(fewer, named[:1])
    if all(a.statistic > (beside(a.hypothesis) if i else least) for i, a in enumerate(named)):
        accepted = tuple(replace(a, threshold=max(a.threshold, least)) for a in first.accepted)
        return replace(first, detector=fewer, loose=start.loose, accepted=accepted)
    return _forward(described.at_least(least), y, start)


def _one_number(start: Start, y: np.ndarray) -> Search | None:
    """The search that ends with one declared number out of its tolerance, if it does."""
    relaxed = strained(start, y)
    return None if relaxed is None else closed(start, y, relaxed)


def _forward(described: Detector, y: np.ndarray, start: Start) -> Search:
    """Forward selection from what is known before anything is named."""
    detector, policy, fitted, x = start.detector, start.detector.policy, start.fitted, start.x0
    covariance, loose = start.covariance, start.loose
    accepted, steps = list[Accepted](), list[Step]()
    refused, fruitless, imitated = set[tuple[str, str]](), 0, False
    while True:
        seen, ranked, step = look(detector, fitted) if accepted else start.glance
        if restless := _restless(detector, accepted, step.parts):
            imitated = True
            fitted, accepted = _without(detector, y, fitted, accepted, restless)
            seen, ranked, step = look(detector, fitted)
        steps.append(step)
        limit = limits_beside(detector, accepted)
        passing = _passing(detector, ranked, accepted, refused, limit)
        if not passing or len(accepted) >= policy.causes or fruitless >= policy.tries or imitated:
            break
        ahead = sorted((_starts(seen, h, policy) for h in passing), key=lambda starts: -worth(starts[0], policy))
        rest = exchanged(detector.study, y, accepted)
        named = partial(_named, detector, y, fitted, accepted)
        alone = None if accepted else start.alone
        more = [[*starts, *_starts_alone(alone, starts, policy)] for starts in foremost(detector, ahead)]
        heat = entering(detector, y, fitted, seen, step.parts) if any(map(_in_hours, passing)) else ()
        more = [starts for starts in _starts_entering(detector, heat, more) if _may_cover(starts, heat, policy)]
        if not more:
            break
        drives = [other for h in passing[: policy.ahead] for other in other_drives(seen, h, policy)]
        as_scores = [h for h in drives if not bent(detector, h)]
        compared = tried(detector, rest, fitted, [*more, *([h] for h in drives if bent(detector, h))])
        proved, others = judged(detector, rest, fitted, compared, named)
        enough = [h for h in proved if proof(detector, h) > policy.named * limit(h)]
        standing = [h for h in enough if possible(detector, h, h.amplitude[0])]
        if not any(proof(detector, h) > limit(h) for h in standing):
            refused.update((h.family, h.name) for h in proved)
            fruitless += 1
            continue
        standing = _covering(detector, heat, step.parts, standing)
        if not standing:
            break
        known = [*standing, *_as_refitted(detector, proved, more, [*others, *ranked]), *as_scores]
        one, rivals = standing[0], _rivals(detector, fitted, standing[0], known)
        accepted.append(replace(as_scored(detector.study, one, detector.thresholds[one.family]), rivals=rivals))
        fitted, accepted = refit(detector, y, beginning(fitted.x, policy), accepted)
        while weak := [a for a in accepted if not stands(detector, a)]:
            refused.update((a.hypothesis.family, a.hypothesis.name) for a in weak)
            fitted, accepted = _without(detector, y, fitted, accepted, weak)
        if in_turn := _in_turn(detector.study, accepted):
            imitated = True
            fitted, accepted = _without(detector, y, fitted, accepted, in_turn)
    if not imitated and (dropped := _leaking(detector, accepted, steps[-1].parts)):
        fitted, accepted, seen, step = _seen_without(detector, y, fitted, accepted, dropped)
        steps.append(step)
    if dropped := uneven(detector, accepted):
        fitted, accepted, seen, step = _seen_without(detector, y, fitted, accepted, dropped)
        steps.append(step)
    if accepted:  # which may have been all that made it seem hotter
        x, covariance = settled(hotter(described, fitted.x), y, accepted)
    left = entering(detector, y, fitted, seen, steps[-1].parts, policy.entering)
    return Search(detector, start.x0, x, tuple(accepted), tuple(steps), fitted, left, covariance, loose)


def naming(found: Search, y: np.ndarray, x: np.ndarray, causes: Sequence[Accepted]) -> Search:
    """A search in y (m,) as if it had named these causes, refitted from parameters x (n,)."""
    detector = found.detector
    fitted, accepted = detector.fitter(y), list[Accepted]()
    if causes:
        fitted, accepted = refit(detector, y, beginning(x, detector.policy), causes)
    seen, _, step = look(detector, fitted)
    x, covariance = settled(detector, y, accepted)
    left = entering(detector, y, fitted, seen, step.parts, detector.policy.entering)
    return replace(
        found, x=x, accepted=tuple(accepted), steps=(*found.steps, step), fitted=fitted, entering=left,
        covariance=covariance,
    )  # fmt: skip


def _named(
    detector: Detector, y: np.ndarray, fitted: Fitted, accepted: Sequence[Accepted], h: Hypothesis
) -> Hypothesis:
    """A strong hypothesis, or one that moves a reading, by what is left once it is named; unchanged where that explains
    no more."""
    if fault_of(h).curved or not (fault_of(h).moves or strong(detector, h)):
        return h
    after, _ = refit(detector, y, beginning(fitted.x, detector.policy), [*accepted, as_scored(detector.study, h)])
    return replace(h, statistic=max(h.statistic, misfit(detector, fitted) - misfit(detector, after)))


def _passing(
    detector: Detector, ranked: Sequence[Hypothesis], accepted: Sequence[Accepted], refused: set[tuple[str, str]],
    limit: Limit,
) -> list[Hypothesis]:  # fmt: skip
    """Hypotheses that may be named next; none where nothing passes its threshold."""
    left = [h for h in ranked if (h.family, h.name) not in refused]
    if not any(h.statistic > limit(h) for h in left):
        return []
    used, named = sum(len(a.units) for a in accepted), [a.hypothesis for a in accepted]
    again = {(h.family, h.name, h.when.name) for h in named}
    return [
        h for h in left
        if h.statistic > detector.policy.named * limit(h) and used + h.batch.q <= K
        and (h.family, h.name, h.when.name) not in again and not _reads(detector.study, h, accepted)
    ]  # fmt: skip


def _covering(
    detector: Detector, heat: Sequence[Entering], parts: dict[str, float], standing: Sequence[Hypothesis]
) -> list[Hypothesis]:
    """Those that explain what heat of any history would, which pays for its freedom: less has imitated it. What
    switches, and the sun, may imitate it within the hours that parts are looked at by, too."""
    by_hour, policy = max(parts.values(), default=0.0), detector.policy
    if by_hour <= detector.thresholds["unknown"]:
        return list(standing)
    finer = max([by_hour, *(own.evidence for own in heat)])
    free = [finer if _in_hours(h) else by_hour for h in standing]
    return [
        h for h, own in zip(standing, free, strict=True)
        if (proof(detector, h) > min(policy.covers * own, own - detector.no_evidence) or fault_of(h).several)
        and (len(h.when.windows) <= policy.switches or h.when.bell is not None or fault_of(h).everywhere)
    ]  # fmt: skip


def _may_cover(starts: Sequence[Hypothesis], heat: Sequence[Entering], policy: SearchPolicy) -> bool:
    """Whether a candidate that acts in hours could explain what heat of any history does once it is refitted: windows
    with many edges take minutes, and end no nearer than who scores less than a leader does."""
    h = max(starts, key=lambda start: start.statistic)
    needed = policy.covers * max((own.evidence for own in heat), default=0.0)
    return not _in_hours(h) or fault_of(h).several or h.statistic > (1.0 - behind(h, policy)) * needed


def _without(
    detector: Detector, y: np.ndarray, fitted: Fitted, accepted: Sequence[Accepted], dropped: Sequence[Accepted]
) -> tuple[Fitted, list[Accepted]]:
    """The fit with the accepted causes that are not dropped."""
    left = [a for a in accepted if a not in dropped]
    return refit(detector, y, fitted.x, left) if left else (detector.fitter(y), left)


def _seen_without(
    detector: Detector, y: np.ndarray, fitted: Fitted, accepted: Sequence[Accepted], dropped: Sequence[Accepted]
) -> tuple[Fitted, list[Accepted], Sight, Step]:
    """The fit without those that are dropped, the causes that are left, and the scores of all hypotheses there."""
    fitted, left = _without(detector, y, fitted, accepted, dropped)
    seen, _, step = look(detector, fitted)
    return fitted, left, seen, step


def _starts(seen: Sight, h: Hypothesis, policy: SearchPolicy) -> list[Hypothesis]:
    """A hypothesis in the windows that it likes best, and a coolant in the one that cold likes best, too."""
    k = next(i for i, own in enumerate(seen.ready) if own.batch is h.batch)
    block = seen.blocks[k][h.place]
    cold = chilled(h, seen.g, block, policy)
    return [grown(h, seen.g, block, policy), *([] if cold is None else [cold])]


def _starts_alone(alone: Alone | None, starts: Sequence[Hypothesis], policy: SearchPolicy) -> list[Hypothesis]:
    """Further starts of a hypothesis where a fit has bent parameters: in the windows that it likes best where nothing
    else is at work, and of a coolant in the hours between."""
    h = starts[0]
    if alone is None or not _in_hours(h):
        return []
    seen, best = alone
    own = best.get((h.family, h.name, h.batch.kind))
    more = [between(h), *([] if own is None else _starts(seen, own, policy))]
    known = [s.when.windows for s in starts]
    return [s for s in more if s is not None and s.when.windows not in known]


def _starts_entering(
    detector: Detector, heat: Sequence[Entering], candidates: list[list[Hypothesis]]
) -> list[list[Hypothesis]]:
    """What switches at the surface where heat of any history enters also begins in the hours in which that is there,
    and between them: at a light part a window that is off by an hour leaves more than most other causes do."""
    for own in heat:
        windows = switched_on(detector, own)
        for starts in candidates:
            h = starts[0]
            if _switches(h) and fault_of(h).grows and own.surface in surfaces_of_place(detector.study, h.name):
                there = within(h, windows)
                starts += [there, *([] if (other := between(there)) is None else [other])]
    return candidates


def _in_hours(h: Hypothesis) -> bool:
    """Whether it acts in hours of its own: in windows, or as the sun does."""
    return bool(h.when.windows) or h.when.bell is not None


def _switches(h: Hypothesis) -> bool:
    return bool(h.when.windows) and h.when.bell is None


def _reads(study: Study, h: Hypothesis, accepted: Sequence[Accepted]) -> bool:
    """Whether it is the loss of a source that reads a corrected signal: what the exact factor leaves there is misfit of
    a source that emits many times as much, and no cause beside it."""
    corrected = [(fault_of(a.hypothesis), a.hypothesis.name) for a in accepted if fault_of(a.hypothesis).corrects]
    wrong = {fault.bare(fault.factor(name)[0]) for fault, name in corrected}
    sources = study.probed.base.load_model.sources
    return any(h.name == f"sources.{s.name}" and wrong & set(s.use.signals.values()) for s in sources)


def _in_turn(study: Study, accepted: Sequence[Accepted]) -> list[Accepted]:
    """Causes that switch at one part, of several families or twice at one place: together they imitate a history."""
    causes = [(a, a.hypothesis) for a in accepted if a.hypothesis.when.windows and a.units]
    passing = [(a, h, parts_of(study, h.name)) for a, h in causes]
    return [
        a for a, h, own in passing
        if any(own & other and b is not a and (h.family != g.family or h.name == g.name) for b, g, other in passing)
    ]  # fmt: skip


def _restless(detector: Detector, accepted: Sequence[Accepted], parts: dict[str, float]) -> list[Accepted]:
    """Causes that switch more than `few` times and leave heat anywhere: a history that no name tells."""
    left = max(parts.values(), default=0.0)
    return [
        a for a in accepted
        if len(a.hypothesis.when.windows) > detector.policy.few and a.hypothesis.when.bell is None and a.units
        and left > max(detector.thresholds["unknown"], _misfit(a))
    ]  # fmt: skip


def _leaking(detector: Detector, accepted: Sequence[Accepted], parts: dict[str, float]) -> list[Accepted]:
    """Causes in windows that leave heat when nothing more can be named. Windows whose edges are fitted are so free
    that one of them tells most of nearly any history: what else it leaves tells that it was another one."""
    left = max(parts.values(), default=0.0)
    return [
        a for a in accepted
        if a.hypothesis.when.windows and a.hypothesis.when.bell is None and a.units and fault_of(a.hypothesis).grows
        and left > max(detector.policy.left * detector.thresholds["unknown"], _misfit(a), detector.no_evidence)
    ]  # fmt: skip


def uneven(detector: Detector, accepted: Sequence[Accepted]) -> list[Accepted]:
    """Causes in the machine of another size in every run: what acts on readings may be set up anew for each."""
    faults = [fault_of(a.hypothesis) for a in accepted]
    return [
        a
        for a, f in zip(accepted, faults, strict=True)
        if (a.units or f.parameter) and differs(a.by_run, f.own, detector.no_evidence)
    ]


def _misfit(a: Accepted) -> float:
    """Heat that a cause in windows may leave because the model is not the machine."""
    return fault_of(a.hypothesis).leaves * a.statistic


def stands(detector: Detector, a: Accepted) -> bool:
    """Whether a cause still explains something beside the others, with a size that physics allows."""
    batch = a.hypothesis.batch
    if batch.fixed:
        return True
    first, fault = float(a.amplitude[0]), fault_of(a.hypothesis)
    known = fault.prior(batch.q)[1] if fault.moves or fault.elsewhere else np.zeros(batch.q)  # which no data tell
    return (
        float(a.amplitude @ (np.linalg.pinv(a.covariance, hermitian=True) - np.diag(known)) @ a.amplitude)
        > detector.policy.stands * a.threshold
        and abs(first) >= detector.policy.stands * batch.smallest
        and possible(detector, a.hypothesis, first)
    )


def _as_refitted(
    detector: Detector, proved: Sequence[Hypothesis], begun: Sequence[Sequence[Hypothesis]],
    others: Sequence[Hypothesis],
) -> list[Hypothesis]:  # fmt: skip
    """Others by what they would explain once they are refitted, where that is less than they score: the share that is
    left of the best of their family and kind, but no less than what may overtake a leader by being refitted has. begun:
    the starts of those that were refitted."""
    scores = {(*_kind(starts[0]), starts[0].name): max(s.statistic for s in starts) for starts in begun}
    left = dict[tuple[str, str], float]()
    for h in proved:
        if bent(detector, h) and (score := scores.get((*_kind(h), h.name), 0.0)) > 0.0:
            left[_kind(h)] = max(left.get(_kind(h), 0.0), h.statistic / score)
    share = [np.clip(left.get(_kind(h), 1.0), 1.0 - behind(h, detector.policy), 1.0) for h in others]
    return [replace(h, statistic=float(part) * h.statistic) for part, h in zip(share, others, strict=True)]


def _kind(h: Hypothesis) -> tuple[str, str]:
    return h.family, h.batch.kind


def _rivals(
    detector: Detector, fitted: Fitted, chosen: Hypothesis, ranked: Sequence[Hypothesis]
) -> tuple[tuple[Hypothesis, float], ...]:
    """Other explanations nearly as likely, with their cosines."""
    near = max(detector.policy.rival, detector.policy.misfit * chosen.statistic)
    worthy = partial(worth, policy=detector.policy)  # by which it was chosen
    likely = [
        h for h in ranked
        if h.statistic > 0.5 * detector.thresholds[h.family]
        and (h.statistic > chosen.statistic - near or worthy(h) > worthy(chosen) - near)
    ]  # fmt: skip
    ordered = [chosen, *sorted(likely, key=lambda h: -h.statistic)]
    same = [h for h in ordered if (h.family, h.name) == (chosen.family, chosen.name)]
    drives = list({h.when.signal: h for h in reversed(same) if h.when.signal != chosen.when.signal}.values())
    others = [*(drives if chosen.when.signal else ()), *distinct(ordered)[1:]]
    return with_cosines(detector, fitted, chosen, others[:8])
