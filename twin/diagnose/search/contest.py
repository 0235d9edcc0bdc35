"""Candidates compared with the exact model before one is named.

A score is exact for what adds heat. What conducts bends: a joint that lost nine tenths of its conductance moves
temperatures nine times as far as its derivative says. So those whose response is not linear are refitted, each alone,
and compared by the misfit that they really remove. Conductances move in t = a / (1 + a), in which temperatures are
nearly linear.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.fitter import Fitted
from twin.diagnose.faults.table import fault_of
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.edges import edges_of, longer, shorter, without_one
from twin.diagnose.search.exact import bends, by_chance, closer, edges_tried, exact, misfit, reached
from twin.diagnose.search.policy import POLICY, SearchPolicy


def _further(h: Hypothesis) -> int:
    """Windows beyond the first one."""
    return max(len(h.when.windows) - 1, 0) if fault_of(h).grows else 0


def worth(h: Hypothesis, policy: SearchPolicy = POLICY) -> float:
    """A statistic less the price of its freedom: how many like it were tried, amplitudes, further windows."""
    tried = len(h.batch.places) * len(h.batch.histories)
    price = policy.amplitude * (h.batch.q - 1) + policy.growth * _further(h)
    return h.statistic - 2.0 * float(np.log(tried)) - price


def proof(detector: Detector, h: Hypothesis) -> float:
    """A refitted statistic as thresholds count it: they know neither edges that are fitted nor further windows."""
    edges = len(edges_of(detector.study, h)) - 2 * _further(h)  # those of further windows are in their price
    return h.statistic - detector.policy.edge * edges - detector.policy.growth * _further(h)


def foremost(detector: Detector, candidates: Sequence[Sequence[Hypothesis]]) -> list[Sequence[Hypothesis]]:
    """Of candidates in all their starts, most worthy first, those that are compared: the first `ahead`, the best of
    every other family (of heat, where a dozen places in the sun score more), and where a score says little as many of a
    kind as are refitted."""
    ahead, count = detector.policy.ahead, Counter[str]()
    found = list(candidates[:ahead])
    families = {starts[0].family for starts in found}
    for starts in candidates[ahead:]:
        kind, family = starts[0].batch.kind, starts[0].family
        badly = _told_badly(detector, starts[0]) and count[kind] < detector.policy.entrants
        if badly or family not in families:
            found.append(starts)
            count[kind] += badly
            families.add(family)
    return found


def judged(
    detector: Detector, y: np.ndarray, fitted: Fitted, candidates: Sequence[Sequence[Hypothesis]],
    named: Callable[[Hypothesis], Hypothesis] = lambda h: h,
) -> tuple[list[Hypothesis], list[Hypothesis]]:  # fmt: skip
    """Candidates, most worthy first: those whose statistics are exact, and the others. named: a strong one by what is
    left once it is named.

    Those that are bent or have edges are refitted, until one leads all others by a share of `behind`, by what both
    score before they are refitted: fitted edges are worth as much to others. What is curved is refitted all the same:
    its score is that of a few sizes and of the described motion. Of several starts of a candidate the first has its
    score; it is the worthiest that they end at.
    """
    worthy = partial(worth, policy=detector.policy)
    done, left, scores = list[Hypothesis](), list[Hypothesis](), dict[int, float]()
    lead, leads_by, count = -np.inf, -np.inf, Counter[str]()
    for starts in sorted(candidates, key=lambda starts: worthy(starts[0]), reverse=True):
        h = starts[0]
        led = worthy(h) < (1.0 - behind(h, detector.policy)) * leads_by
        bends = bent(detector, h)
        if (led and not _told_badly(detector, h)) or (bends and count[h.batch.kind] >= detector.policy.entrants):
            left.append(h)
            continue
        count[h.batch.kind] += bends
        now = _refitted(detector, y, fitted, starts, lead) if bends else h
        if worthy(now) > lead:
            lead = worthy(now)
            leads_by = min(lead, max(worthy(h), (1.0 - detector.policy.saturates) * lead))
        done.append(now)
        scores[id(now)] = worthy(h)
    straight = [h for h in left if not bent(detector, h)]
    order = _fair(detector, y, fitted, [*done, *straight], scores)
    return _closely(detector, y, fitted, order, named), [h for h in left if bent(detector, h)]


def _refitted(
    detector: Detector, y: np.ndarray, fitted: Fitted, starts: Sequence[Hypothesis], lead: float
) -> Hypothesis:
    """The worthiest that the starts of a candidate end at. Where edges are fitted they get few passes, and go on from
    there if that is near what leads: losers take as long to arrive as the winner."""
    worthy, policy = partial(worth, policy=detector.policy), detector.policy
    if not edges_of(detector.study, starts[0]):
        return max((exact(detector, y, fitted, s) for s in starts), key=worthy)
    best = max((exact(detector, y, fitted, s, policy.trial) for s in starts), key=worthy)
    near = 1.0 - (policy.saturates if fault_of(best).wets else policy.behind)
    if worthy(best) < near * lead:
        return best
    return max(best, exact(detector, y, fitted, best), key=worthy)


def behind(h: Hypothesis, policy: SearchPolicy) -> float:
    """Share of the leader's score that a hypothesis may lack and overtake it by being refitted."""
    if h.when.windows and h.when.bell is None:
        return policy.switched
    return policy.saturates if fault_of(h).saturates else policy.behind


def tried(
    detector: Detector, y: np.ndarray, fitted: Fitted, candidates: Sequence[Sequence[Hypothesis]]
) -> list[Sequence[Hypothesis]]:
    """Candidates of `judged`, most worthy first. Where a coolant leads, it and others within `saturates` have been
    refitted for some passes, in ever longer windows and in fewer: a film saturates most at the wetted face, which
    linearity would leave aside, and within the hour, where linearity ends its window. From the last of their starts;
    where the fit has bent parameters, from all of them."""
    order = sorted(candidates, key=lambda starts: -worth(starts[0], detector.policy))
    if not order or not fault_of(order[0][0]).wets:
        return order
    least = (1.0 - detector.policy.saturates) * worth(order[0][0], detector.policy)
    strong = bends(fitted.x, detector.policy)

    def trial(starts: Sequence[Hypothesis]) -> Hypothesis:
        ended = [exact(detector, y, fitted, s, detector.policy.trial) for s in (starts if strong else starts[-1:])]
        return _in_other_windows(detector, y, fitted, max(ended, key=partial(worth, policy=detector.policy)))

    passed = [
        (trial(starts),) if fault_of(starts[0]).wets and worth(starts[0], detector.policy) > least else starts
        for starts in order
    ]
    return sorted(passed, key=lambda starts: -worth(starts[0], detector.policy))


def _in_other_windows(detector: Detector, y: np.ndarray, fitted: Fitted, h: Hypothesis) -> Hypothesis:
    """A refitted coolant in windows twice as long, or without one of them, and so on, while that explains more: they
    were chosen by scores that take its film as linear. Where the fit has bent parameters in halves of them, too, and
    with edges nearby."""
    study, policy = detector.study, detector.policy
    worthy = partial(worth, policy=policy)
    while True:
        starts = [longer(study, detector.elements, h), *without_one(study, h)]
        if bends(fitted.x, policy):
            starts += [*shorter(study, h), edges_tried(detector, y, fitted, h)]
        tried_ones = (exact(detector, y, fitted, s, policy.trial) for s in starts if s is not h)
        best = max(tried_ones, key=worthy, default=h)
        if worthy(best) <= worthy(h):
            return h
        h = best


def _fair(
    detector: Detector, y: np.ndarray, fitted: Fitted, candidates: Sequence[Hypothesis], scores: Mapping[int, float]
) -> list[Hypothesis]:
    """Candidates, most worthy first; scores: of those that may have been refitted, by id, before they were. One that
    leads by its score while another near it was refitted is refitted, too: the exact model takes some hundredths from
    each, and that alone would decide between the two. Beside a leader that was refitted what acts on readings alone is,
    too, and the best of every other kind whose score is near that of the leader: parameters may have bent to either, so
    that what the leader has gained by being refitted others may gain as well. A misplaced source, and a change of a
    known size, are scored from the description, where nothing has bent: beside those more is near."""
    worthy = partial(worth, policy=detector.policy)
    order, exactly = sorted(candidates, key=worthy, reverse=True), set[int]()
    if order and (bent(detector, order[0]) or order[0].batch.fixed):
        lead, kinds = order[0], set[str]()
        from_description = fault_of(lead).elsewhere or lead.batch.fixed
        lacks = detector.policy.saturates if from_description else detector.policy.behind
        least = (1.0 - detector.policy.behind) * worthy(lead)
        score = (1.0 - lacks) * scores.get(id(lead), worthy(lead))
        for i, h in enumerate(order):
            as_near = worthy(h) > score and not (bent(detector, h) or h.batch.fixed)
            if (_follows(h) and worthy(h) > least) or (as_near and h.batch.kind not in kinds):
                order[i] = exact(detector, y, fitted, h)
                exactly.add(id(order[i]))
            kinds |= {h.batch.kind} if as_near else set()
        order.sort(key=worthy, reverse=True)
    while True:
        lead = order[0]
        near = [h for h in order[1:] if worthy(h) > (1.0 - detector.policy.behind) * worthy(lead)]
        settled = bent(detector, lead) or id(lead) in exactly or fault_of(lead).read or lead.batch.fixed
        if settled or not any(bent(detector, h) or id(h) in exactly for h in near):
            break
        order[0] = exact(detector, y, fitted, lead)
        exactly.add(id(order[0]))
        order.sort(key=worthy, reverse=True)
    return order


def _closely(
    detector: Detector, y: np.ndarray, fitted: Fitted, order: Sequence[Hypothesis],
    named: Callable[[Hypothesis], Hypothesis],
) -> list[Hypothesis]:  # fmt: skip
    """Candidates in order, once the strong ones among those near the leader are fitted closer: few, and where the
    leader leaves more than chance, for derivatives beside a cause take as long as a calibration. Of several, each then
    is named: one may lead by the errors of another one's response, which channels show otherwise than the model.

    Where a source may be elsewhere or heat be missing, whatever the leader leaves: to first order a source loses all of
    its heat for a few units, and what is missing where it really is does the same."""
    policy, worthy = detector.policy, partial(worth, policy=detector.policy)
    least = (1.0 - policy.behind) * max((worthy(h) for h in order), default=0.0)
    near = [h for h in order[: policy.closest] if worthy(h) > least]
    if len({fault_of(h).elsewhere for h in near}) > 1:
        compared = [reached(detector, y, fitted, h) for h in near]
    elif order and misfit(detector, fitted) - order[0].statistic <= by_chance(fitted.residual, policy):
        return list(order)
    else:
        compared = [closer(detector, y, fitted, h) for h in near]
        compared = [named(h) for h in compared] if len(near) > 1 else compared
    return sorted([*compared, *order[len(near) :]], key=worthy, reverse=True)


def _follows(h: Hypothesis) -> bool:
    """Whether a hypothesis acts on readings in proportion to a size that is free."""
    return fault_of(h).read and not fault_of(h).curved and not h.batch.fixed


def _told_badly(detector: Detector, h: Hypothesis) -> bool:
    """Whether a score says little: of what is curved, and of a conductance that is nearly gone, which moves
    temperatures by far more."""
    return fault_of(h).curved or (fault_of(h).conducts and h.amplitude[0] < detector.policy.gone)


def bent(detector: Detector, h: Hypothesis) -> bool:
    fault = fault_of(h)
    return fault.bent or fault.stepped or bool(edges_of(detector.study, h))
