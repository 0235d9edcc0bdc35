"""One declared number out of its tolerance: a source, film, joint or contact that calibration moves too far.

It is the verdict where freeing it leaves nothing, or so little that a discrepancy of its own explains that.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
import scipy.linalg

from twin.diagnose.evidence.batch import Hypothesis, score
from twin.diagnose.evidence.fitter import Fitted, bounds
from twin.diagnose.evidence.pulls import Loose
from twin.diagnose.evidence.settled import settled_alone
from twin.diagnose.evidence.sight import Sight
from twin.diagnose.faults.loss_law import is_source
from twin.diagnose.faults.table import family_of_parameter, fault_of
from twin.diagnose.search.accepted import Accepted, as_scored, freed, parameter_of, readings_columns, settled
from twin.diagnose.search.contest import bent
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.exact import beginning, by_chance, exact, misfit, misfit_of_each, unbent, unexplained
from twin.diagnose.search.look import Search, Step, cosines, look
from twin.diagnose.search.policy import SearchPolicy
from twin.diagnose.search.refit import refit


def closed(
    detector: Detector, y: np.ndarray, before: Fitted, declared: Sequence[Hypothesis],
    glance: tuple[Sight, list[Hypothesis], Step], relaxed: tuple[Fitted, Accepted], x0: np.ndarray,
    loose: tuple[Loose, ...],
) -> Search | None:  # fmt: skip
    """The search that ends with one declared number out of its tolerance; None where that leaves something, or where
    something else that was seen before (glance) explains more. What explains nearly as much is its rival."""
    fitted, one = relaxed
    _, ranked, first = glance
    seen, left, last = look(detector, fitted)
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
    # both begin at the declared number: what either explains is the same but for what is left
    fits = {h.name for h in declared if h.statistic > removed - detector.policy.close}
    (j,) = freed(detector.study, one.hypothesis)
    rivals = one.rivals + tuple(
        (replace(h, statistic=one.statistic), 1.0) for h, cosine, heat in _factors(detector, j)
        if h.name in fits or _does_the_same(detector, one, cosine, heat)
    )  # fmt: skip
    # a part that expands too much moves the expansion of its material, or of another: with the part's free it stays
    known = {one.hypothesis.name, *(h.name for h, _ in one.rivals)}
    family = [h for h in ranked if h.family == one.hypothesis.family and h.name not in known]
    most = detector.policy.stands * abs(float(before.x[j]))
    near = [
        h for h in family
        if h.statistic > removed - detector.policy.close and abs(_beside(detector, before, j, h)) < most
    ]  # fmt: skip
    rivals += tuple((h, float(cosines(detector, before, [one.hypothesis, h])[0, 1])) for h in near)
    amplitude, variance = _size(one, next(own for own in loose if own.index == j), detector)
    one = replace(
        one, hypothesis=replace(one.hypothesis, statistic=one.statistic), rivals=rivals,
        amplitude=np.array([amplitude]), covariance=np.array([[variance]]),
    )  # fmt: skip
    x, covariance = settled(detector, y, (one,))
    return Search(
        detector, x0, x, (one,), (first, last), fitted.residual, seen.g, seen.heat, covariance,
        misfit_of_each(detector, fitted), unexplained(detector, fitted), loose,
    )  # fmt: skip


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


@dataclass(frozen=True)
class Freed:
    """What has been freed of its tolerance so far, beside one fit: it takes seconds, and a second search asks again."""

    settled: dict[int, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)  # by parameter: x (n,), covariance
    refitted: dict[str, tuple[Fitted, Accepted]] = field(default_factory=dict)  # by place


def loose_ones(
    detector: Detector, y: np.ndarray, fitted: Fitted, settled: np.ndarray, known: Freed
) -> tuple[Loose, ...]:
    """The declared numbers farthest out of their tolerance, `far` at most, by two calibrations; settled (n,).

    Out of its tolerance is what lies outside without one, too, on the same side, and surely not where it was declared:
    by the settled calibration, or by the fit that finds causes where the other does not contradict it. The former is
    sure of no film of a heavy body and of no small source, but not biased; the latter takes for them what another mesh
    makes of a joint. So where it alone is sure it is to be as sure as any cause has to be.
    """
    policy, strain, found = detector.policy, detector.pulls.strain(fitted.x, settled), list[Loose]()
    for j in (int(j) for j in np.argsort(-strain) if strain[j] >= 1.0):
        if j not in known.settled:
            known.settled[j] = settled_alone(detector.fitter, y, (j,))
        x, covariance = known.settled[j]
        robust = Loose(j, float(x[j]), float(np.sqrt(covariance[j, j])), float(strain[j]))
        efficient = Loose(j, *_untied(fitted, j), float(strain[j]), settled=False)
        family = family_of_parameter(detector.study.probed.parameters[j])
        estimates = [(robust, max(policy.sure, float(np.sqrt(detector.least))))]
        if not _contradicted(efficient, robust, policy):
            estimates.append((efficient, float(np.sqrt(detector.thresholds[family]))))
        for own, sure in estimates:
            if np.sign(fitted.x[j]) * own.x > max(policy.outside, sure * own.sigma):
                found.append(replace(own, rivals=_signals(detector, own)))
                break
        if len(found) == policy.far:
            break
    return tuple(found)


def _contradicted(efficient: Loose, robust: Loose, policy: SearchPolicy) -> bool:
    """Whether a robust estimate refutes an efficient one, by less than `alone` of which it may differ for other
    reasons (Hausman, Econometrica 46, 1978: two estimates of which one alone suffers from what is misspecified)."""
    toward = float(np.sign(efficient.x))
    return toward * robust.x + policy.sure * robust.sigma < policy.alone * abs(efficient.x)


def _untied(fitted: Fitted, j: int) -> tuple[float, float]:
    """A parameter as the fit has it without its tolerance, to first order, and its standard deviation.

    Of a posterior N(x, v) under the prior N(0, 1), the data alone say N(x / (1 - v), v / (1 - v)).
    """
    variance = _variance(fitted, j)
    return float(fitted.x[j]) / (1.0 - variance), float(np.sqrt(variance / (1.0 - variance)))


def _variance(fitted: Fitted, j: int) -> float:
    """Of a parameter beside all nuisances, in prior variances: below 1."""
    unit = np.zeros(len(fitted.projector.factor[0]))
    unit[j] = 1.0
    return min(float(scipy.linalg.cho_solve(fitted.projector.factor, unit)[j]), 1.0 - 1e-12)


def _signals(detector: Detector, own: Loose) -> tuple[tuple[Hypothesis, float], ...]:
    """Exact factors of signals that warm what a source warms, by as much as its number without a tolerance says; with
    the source's own statistic, as they do the same."""
    if not is_source(detector.study.probed.parameters[own.index]):
        return ()
    policy, scale = detector.policy, float(detector.study.scale[own.index])
    return tuple(
        (replace(h, statistic=own.strain**2), cosine) for h, cosine, heat in _factors(detector, own.index)
        if abs(cosine) >= policy.same and heat > 0.0
        and abs(np.log(heat) - scale * own.x) < policy.sure * scale * own.sigma
    )  # fmt: skip


def _factors(detector: Detector, j: int) -> Iterator[tuple[Hypothesis, float, float]]:
    """Exact factors of signals: with the cosine of what each and a declared number do, and times what heat, were that
    number a source's, each multiplies it by."""
    own = detector.whiten(detector.fitter.linear(np.zeros(len(detector.study.scale)))[1][:, j])
    own = own / detector.study.scale[j]
    size = float(own @ own)
    for batch in detector.columns.batches:
        for i, _ in enumerate(batch.places if fault_of(batch).corrects else ()):
            signal = detector.columns.raw[:, batch.columns[i, 0]].astype(float)
            along = float(signal @ own)
            cosine = along / np.sqrt(max(size * float(signal @ signal), 1e-30))
            yield Hypothesis(batch, i, batch.histories[0], 0.0, (1.0,), 0.0), float(cosine), 1.0 + along / size


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
    """Whether a factor of a signal does just what a source's number does (cosine, heat: see `_factors`), and is of the
    fitted size: far from the description it may not fit to first order."""
    factor = float(one.amplitude[0])
    sigma = float(np.hypot(np.sqrt(one.covariance[0, 0]), detector.policy.form * factor))
    far = fault_of(one.hypothesis).parameter and abs(factor) > detector.policy.distant
    return far and abs(cosine) >= detector.policy.same and heat > 0.0 and abs(np.log(heat) - factor) < 2.0 * sigma


def _stays(detector: Detector, fitted: Fitted, one: Accepted, other: Hypothesis) -> bool:
    """Whether a declared number is as far out of its tolerance beside another cause, to first order."""
    (j,) = freed(detector.study, one.hypothesis)
    return abs(_beside(detector, fitted, j, other)) > detector.policy.beyond


def _beside(detector: Detector, fitted: Fitted, j: int, h: Hypothesis) -> float:
    """A parameter beside a hypothesis, to first order."""
    columns = readings_columns(detector, h)
    free = detector.policy.wide * columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-30)
    return float(detector.fitter.projector(fitted.J, free).most_likely(detector.whiten(fitted.residual))[j])


def _weak(detector: Detector, ranked: Sequence[Hypothesis], misfits: float) -> bool:
    """Whether nothing is strong enough to be named beside another cause."""
    return all(h.statistic < max(detector.policy.later * detector.thresholds[h.family], misfits) for h in ranked)


def strained(
    detector: Detector, y: np.ndarray, fitted: Fitted, loose: Sequence[Loose],
    glance: tuple[Sight, list[Hypothesis], Step], known: Freed,
) -> tuple[Fitted, Accepted] | None:  # fmt: skip
    """Of the declared numbers out of their tolerance the one that leaves least, freed of it, and as its rivals those
    that leave as much but for chance; None if there is none, or what was seen at a glance explains so much more that it
    would be left. Of those the first is the one farthest beyond what synthetic measurements show: a loss that a fit has
    reached within its tolerance, however surely, leaves no less once it is freed, and discrepancy at a joint does."""
    policy = detector.policy
    strain = {own.index: own.strain for own in loose}
    found = []
    for batch in detector.columns.batches:
        fault = fault_of(batch)
        for i, name in enumerate(batch.places if fault.declared else ()):
            if (j := parameter_of(detector.study, name)) is None or j not in strain:
                continue
            always = next(h for h in batch.histories if not h.windows)
            size, _ = fault.amplitude(float(fitted.x[j] * detector.study.scale[j]))
            likelihood = float((policy.pulled * strain[j]) ** 2)
            found.append(Hypothesis(batch, i, always, likelihood, (size,), float(detector.study.scale[j] ** -2.0)))
    seen, ranked, _ = glance
    most = ranked[0].statistic if ranked else 0.0
    freed_ones, before = [], misfit(detector, fitted)
    for h in sorted(found, key=lambda h: -h.statistic):
        # a film many times as large scores hardly anything by its derivative, nor does what a fit has reached: that may
        # leave as much as its own discrepancy makes
        likely = fault_of(h).faint or _scored(detector, fitted, seen, h) > policy.faint * most
        if not likely and policy.roughly * (1.0 - policy.covers) * _told_alone(detector, fitted, h) < most:
            continue
        made = _freed(detector, y, fitted, h, known)
        if made and (
            likely or ((1.0 - policy.covers) * made[1].statistic > most and misfit(detector, made[0]) < before)
        ):
            freed_ones.append(made)
    if not freed_ones:
        return None
    left = [misfit(detector, fit) for fit, _ in freed_ones]
    near = [made for made, own in zip(freed_ones, left, strict=True) if own < min(left) + policy.close]
    (fit, one), *others = sorted(near, key=lambda made: -strain[freed(detector.study, made[1].hypothesis)[0]])
    return fit, replace(one, rivals=_as_rivals(detector, fitted, one, [other for _, other in others]))


def _as_rivals(
    detector: Detector, fitted: Fitted, one: Accepted, others: Sequence[Accepted]
) -> tuple[tuple[Hypothesis, float], ...]:
    """Freed numbers as rivals of one of them, of their own size and its statistic: either explains the same."""
    rivals = [replace(o.hypothesis, amplitude=tuple(o.amplitude.tolist()), statistic=one.statistic) for o in others]
    cosine = cosines(detector, fitted, [one.hypothesis, *rivals])
    return tuple((h, float(cosine[0, i + 1])) for i, h in enumerate(rivals))


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
    return float(fitted.x[j]) ** 2 * (1.0 / _variance(fitted, j) - 1.0)


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
    if not sigma > 0.0 or not h.batch.possible(h.place, change):
        return None
    # as a logarithm: derivatives at many times a film say little of the film itself
    change, sigma = fault_of(h).log_change(change, sigma)
    statistic = (change / sigma) ** 2
    return (fitted, replace(one, statistic=statistic)) if statistic >= max(one.threshold, detector.least) else None
