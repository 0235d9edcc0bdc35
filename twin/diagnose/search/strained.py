"""One declared number out of its tolerance: a source, film, joint or contact that calibration moves too far.

It is the verdict where freeing it leaves nothing, or so little that a discrepancy of its own explains that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from twin.diagnose.evidence.batch import Hypothesis, score
from twin.diagnose.evidence.fitter import Fitted, bounds
from twin.diagnose.evidence.pulls import Loose
from twin.diagnose.evidence.sight import Sight
from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.study import own_place
from twin.diagnose.search.accepted import Accepted, as_scored, freed, parameter_of, possible, readings_columns, settled
from twin.diagnose.search.contest import bent
from twin.diagnose.search.detector import ALARM, Detector
from twin.diagnose.search.exact import beginning, by_chance, exact, misfit, unbent
from twin.diagnose.search.look import Search, distinct, look, with_cosines
from twin.diagnose.search.loose import Freed, factors_of, variance_of
from twin.diagnose.search.refit import refit
from twin.diagnose.search.start import Start


def closed(start: Start, y: np.ndarray, relaxed: tuple[Fitted, Accepted]) -> Search | None:
    """The search of measurements y (m,) that ends with one declared number out of its tolerance, relaxed as by
    `strained`; None where that leaves something, or where something else that was seen before (`Start.glance`) explains
    more. What explains nearly as much is its rival."""
    detector, before, declared, loose = start.detector, start.fitted, start.declared, start.loose
    fitted, one = relaxed
    _, ranked, first = start.glance
    _, left, last = look(detector, fitted)
    misfits = (1.0 - detector.policy.covers) * one.statistic  # that it may leave
    room = max(detector.thresholds["unknown"], misfits)
    if not _weak(detector, left, misfits) or max(last.parts.values(), default=0.0) > room:
        return None
    if _explained(detector, y, before, fitted, ranked):
        return None
    removed = misfit(detector, before) - misfit(detector, fitted)
    more = [h for h in ranked if h.statistic - detector.policy.rival * any(h is d for d in declared) > removed]
    passing = [i for i, h in enumerate(more) if h.statistic > detector.thresholds[h.family]]

    @cache
    def removes_more(i: int) -> bool:
        """What bends scores more than it removes, which a refit tells: each takes seconds, so no more than is asked."""
        return not bent(detector, more[i]) or exact(detector, y, before, more[i]).statistic > removed

    def leads(i: int) -> bool:
        """Whether it is among the first that remove more."""
        most = detector.policy.others
        return removes_more(i) and (i < most or sum(map(removes_more, range(i))) < most)

    # beside which it would no longer be as far out of its tolerance: to first order, so that few are refitted, and from
    # where a cause is refitted
    there = unbent(detector, y, before)
    instead = [i for i, h in enumerate(more if passing else ()) if not _stays(detector, there, one, h)]
    if any(map(leads, instead)) and any(map(removes_more, sorted(passing, key=lambda i: bent(detector, more[i])))):
        return None
    # both begin at the declared number: what either explains is the same but for what is left. Where the tolerance
    # holds most of the number that is so little that any factor would do: beside it the number has to be another one
    (j,) = freed(detector.study, one.hypothesis)
    off = abs(float(before.x[j]))
    fits = {
        h.name for h in declared
        if h.statistic > removed - detector.policy.close
        and abs(beside(detector, before, j, h)) < detector.policy.covers * off
    }  # fmt: skip
    rivals = one.rivals + tuple(
        (replace(h, statistic=one.statistic), 1.0) for h, cosine, heat in factors_of(detector, j)
        if h.name in fits or _does_the_same(detector, one, cosine, heat)
    )  # fmt: skip
    # of a number that little tells anything would be within chance: half of what it removes is the least
    enough = max(removed - detector.policy.close, 0.5 * removed)
    # a part that expands too much moves the expansion of its material, or of another: with the part's free it stays
    known = {one.hypothesis.name, *(h.name for h, _ in one.rivals)}
    family = [h for h in ranked if h.family == one.hypothesis.family and h.name not in known]
    near = [
        h for h in family
        if h.statistic > enough
        and abs(beside(detector, before, j, h)) < detector.policy.stands * off
    ]  # fmt: skip
    # nor is a number out of its tolerance for sure where a cause beside which it is not explains more: too little to be
    # named alone, but more than its family does by chance. At the same place, with no window to choose, it need not:
    # more of a film, or of its medium another temperature. What bends scores more than it removes, and is refitted
    # there alone: motion that cools a film
    known |= {h.name for h, _ in rivals}
    likely = [
        h for h in more[: detector.policy.others]
        if h.name not in known and h.statistic > max(removed + detector.policy.close, often(detector, h.family))
        and not bent(detector, h) and not _stays(detector, there, one, h)
    ]  # fmt: skip
    here = [
        exact(detector, y, before, h) if bent(detector, h) else h for h in ranked
        if h.name == one.hypothesis.name and h.family != one.hypothesis.family
        and (bent(detector, h) or not h.when.windows) and not _stays(detector, there, one, h)
    ]  # fmt: skip
    likely += [h for h in here if h.statistic > enough and possible(detector, h, h.amplitude[0])]
    # what does the same elsewhere is told from it by nothing: heat of a source that never rests, and warmer air there
    as_much = [
        h for h in ranked
        if h.name not in known and h.family != one.hypothesis.family and h.name != _heated(detector, j)
        and h.statistic > enough and not bent(detector, h) and not h.when.windows
    ]  # fmt: skip
    likely += [
        h for h, cosine in with_cosines(detector, before, one.hypothesis, as_much)
        if cosine**2 > detector.policy.covers and removed * (1.0 - cosine**2) < detector.policy.apart
        and not _stays(detector, there, one, h)
    ]  # fmt: skip
    near = distinct([*near, *likely])
    rivals += tuple(pair for h in near for pair in with_cosines(detector, before, one.hypothesis, [h]))
    amplitude, variance = _size(one, next(own for own in loose if own.index == j), detector)
    one = replace(
        one, hypothesis=replace(one.hypothesis, statistic=one.statistic), rivals=rivals,
        amplitude=np.array([amplitude]), covariance=np.array([[variance]]),
    )  # fmt: skip
    x, covariance = settled(detector, y, (one,))
    return Search(detector, start.x0, x, (one,), (first, last), fitted, (), covariance, loose)


def _heated(detector: Detector, j: int) -> str:
    """The place that the source of a declared number heats, whose heat is told by the source; "" of other numbers."""
    study, p = detector.study, detector.study.probed.parameters[j]
    sources = study.probed.base.load_model.sources
    own = next((k for k, s in enumerate(sources) if p.kind == "source" and s.name in p.targets and not s.contact), None)
    at = None if own is None else own_place(study, own)
    return "" if at is None else study.probed.places[at].name


def often(detector: Detector, family: str) -> float:
    """The statistic that a family reaches in ALARM of all synthetic measurements."""
    values = detector.nulls[family]
    return float(np.quantile(values, 1.0 - ALARM)) if len(values) else 0.0


def _explained(detector: Detector, y: np.ndarray, before: Fitted, fitted: Fitted, ranked: Sequence[Hypothesis]) -> bool:
    """Whether another cause alone leaves no more than chance does, where the freed number leaves more: a faulty sensor
    moves parameters by many of their standard deviations, of which a tenth may be as much as the fault."""
    policy, least = detector.policy, by_chance(y, detector.policy)
    if misfit(detector, fitted) <= least:
        return False
    needed = misfit(detector, before) - least
    near = (1.0 - policy.saturates) * needed
    likely = [h for h in ranked if h.statistic > max(near, detector.thresholds[h.family])][: policy.closely]
    return any((h if h.batch.fixed else exact(detector, y, before, h)).statistic > needed for h in likely)


def _size(one: Accepted, loose: Loose, detector: Detector) -> tuple[float, float]:
    """The amplitude of a number out of its tolerance, and its variance, of the settled calibration: the other fit
    leaves to model discrepancy what looks like it. But that knows sizes beyond the bounds, and those of which the
    settled one is not sure."""
    study = detector.study
    scale = float(study.scale[loose.index])
    low, high = (detector.policy.nearly * float(ends[loose.index]) for ends in bounds(study))
    if not loose.settled or not low < loose.x < high:
        return float(one.amplitude[0]), float(one.covariance[0, 0])
    amplitude, sigma = fault_of(one.hypothesis).amplitude(scale * loose.x, scale * loose.sigma)
    return amplitude, sigma**2


def _does_the_same(detector: Detector, one: Accepted, cosine: float, heat: float) -> bool:
    """Whether a factor of a signal does just what a source's number does (cosine, heat: `factors_of`), and is of the
    fitted size: far from the description it may not fit to first order."""
    factor = float(one.amplitude[0])
    sigma = float(np.hypot(np.sqrt(one.covariance[0, 0]), detector.policy.form * factor))
    far = fault_of(one.hypothesis).parameter and abs(factor) > detector.policy.distant
    return far and abs(cosine) >= detector.policy.same and heat > 0.0 and abs(np.log(heat) - factor) < 2.0 * sigma


def _stays(detector: Detector, fitted: Fitted, one: Accepted, other: Hypothesis) -> bool:
    """Whether a declared number is as far out of its tolerance beside another cause, to first order."""
    (j,) = freed(detector.study, one.hypothesis)
    return abs(beside(detector, fitted, j, other)) > detector.policy.beyond


def beside(detector: Detector, fitted: Fitted, j: int, h: Hypothesis) -> float:
    """A parameter beside a hypothesis, to first order."""
    columns = readings_columns(detector, h)
    free = detector.policy.wide * columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-30)
    return float(detector.fitter.projector(fitted.J, free).most_likely(detector.whiten(fitted.residual))[j])


def _weak(detector: Detector, ranked: Sequence[Hypothesis], misfits: float) -> bool:
    """Whether nothing is strong enough to be named beside another cause."""
    return all(h.statistic < max(detector.policy.later * detector.thresholds[h.family], misfits) for h in ranked)


def strained(start: Start, y: np.ndarray) -> tuple[Fitted, Accepted] | None:
    """Of the declared numbers out of their tolerance the one that leaves least, freed of it, and as its rivals those
    that leave as much but for chance; None if there is none, or what was scored explains so much more that it would be
    left. Of those the first is the one farthest beyond what synthetic measurements show: a loss that a fit has
    reached within its tolerance, however surely, leaves no less once it is freed, and discrepancy at a joint does."""
    detector, fitted, policy = start.detector, start.fitted, start.detector.policy
    strain = {own.index: own.strain for own in start.loose}
    found = []
    for batch in detector.columns.batches:
        fault = fault_of(batch)
        for i, name in enumerate(batch.places if fault.declared else ()):
            if (j := parameter_of(detector.study, name)) is None or j not in strain:
                continue
            always = next(h for h in batch.histories if not h.windows)
            size, _ = fault.amplitude(float(fitted.x[j] * detector.study.scale[j]))
            likelihood = float((policy.pulled * strain[j]) ** 2)
            found.append(Hypothesis(batch, i, always, likelihood, (size,)))
    seen, ranked, _ = start.scored
    most = ranked[0].statistic if ranked else 0.0
    freed_ones, before = [], misfit(detector, fitted)
    for h in sorted(found, key=lambda h: -h.statistic):
        # a film many times as large scores hardly anything by its derivative, nor does what a fit has reached: that may
        # leave as much as its own discrepancy makes
        likely = fault_of(h).faint or _scored(detector, fitted, seen, h) > policy.faint * most
        if not likely and policy.roughly * (1.0 - policy.covers) * _told_alone(detector, fitted, h) < most:
            continue
        made = _freed(detector, y, fitted, h, start.freed)
        if made and (
            likely or ((1.0 - policy.covers) * made[1].statistic > most and misfit(detector, made[0]) < before)
        ):
            freed_ones.append(made)
    if not freed_ones:
        return None
    left = [misfit(detector, fit) for fit, _ in freed_ones]
    near = [made for made, own in zip(freed_ones, left, strict=True) if own < min(left) + policy.close]
    (fit, one), *others = sorted(near, key=lambda made: -strain[freed(detector.study, made[1].hypothesis)[0]])
    rivals = [  # of their own size and its statistic: either explains the same
        replace(own.hypothesis, amplitude=tuple(own.amplitude.tolist()), statistic=one.statistic) for _, own in others
    ]
    return fit, replace(one, rivals=with_cosines(detector, fitted, one.hypothesis, rivals))


def _scored(detector: Detector, fitted: Fitted, seen: Sight, h: Hypothesis) -> float:
    """What a declared number scores by its derivative, and a contact by its response when it is nearly gone."""
    own = next(own for own in seen.ready if own.batch is h.batch)
    best = float(score(own, seen.g).statistic[h.place].max())
    if (D := detector.lost.response(h)) is not None:
        P = fitted.projector(D)
        best = max(best, float(P @ detector.whiten(fitted.residual)) ** 2 / max(float(D @ P), 1e-30))
    return best


def _told_alone(detector: Detector, fitted: Fitted, h: Hypothesis) -> float:
    """Likelihood-ratio units by which data without its tolerance tell a fitted number from the declared one."""
    (j,) = freed(detector.study, h)
    return float(fitted.x[j]) ** 2 * (1.0 / variance_of(fitted, j) - 1.0)


def _freed(
    detector: Detector, y: np.ndarray, fitted: Fitted, h: Hypothesis, known: Freed
) -> tuple[Fitted, Accepted] | None:
    """The fit with a declared number at any value; None where that changes nothing, is beyond what physics has, or lies
    within the tolerance."""
    policy = detector.policy
    if h.name not in known.refitted:
        one = as_scored(detector.study, h, policy.pulled**2)
        at, (one,) = refit(detector, y, beginning(fitted.x, policy), [one])
        known.refitted[h.name] = at, one
    fitted, one = known.refitted[h.name]
    change, sigma = float(one.amplitude[0]), float(np.sqrt(one.covariance[0, 0]))
    if not sigma > 0.0 or not possible(detector, h, change):
        return None
    # as a logarithm: derivatives at many times a film say little of the film itself
    change, sigma = fault_of(h).log_change(change, sigma)
    statistic = (change / sigma) ** 2
    return (fitted, replace(one, statistic=statistic)) if statistic >= max(one.threshold, detector.least) else None
