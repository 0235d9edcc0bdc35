"""Candidates compared with the exact model before one is named.

A score is exact for what adds heat. What conducts bends: a joint that lost nine tenths of its conductance moves
temperatures nine times as far as its derivative says. So those whose response is not linear are refitted, each alone,
and compared by the misfit that they really remove. Conductances move in t = a / (1 + a), in which temperatures are
nearly linear.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.fitter import Fitted, bounds
from twin.diagnose.faults.acted import units_of
from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.over_runs import over_runs
from twin.diagnose.model.study import K
from twin.diagnose.search.accepted import curved_change, curved_slope, freed, jacobian, motion, readings_columns
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.edges import Edge, edges_of, moved, with_pulses
from twin.diagnose.search.policy import POLICY, SearchPolicy


def misfit(detector: Detector, fitted: Fitted) -> float:
    """Sum of squares of what a fit leaves, in units of noise and model discrepancy; where the description says that one
    can leave less, this: what better parameters remove is no cause's."""
    return min(float(misfit_of_each(detector, fitted).sum()), fitted.reachable)


def misfit_of_each(detector: Detector, fitted: Fitted) -> np.ndarray:
    """(m,) what each number has in that sum."""
    white = detector.whiten(fitted.residual)
    return np.asarray(white * fitted.projector(white))


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


def judged(
    detector: Detector, y: np.ndarray, fitted: Fitted, candidates: Sequence[Sequence[Hypothesis]]
) -> tuple[list[Hypothesis], list[Hypothesis]]:
    """Candidates, most worthy first: those whose statistics are exact, and the others.

    Those that are bent or have edges are refitted, until one leads all others by a share of `behind`, by what both
    score before they are refitted: fitted edges are worth as much to others. What is curved is refitted all the same:
    its score is that of a few sizes and of the described motion. Of several starts of a candidate the first has its
    score; it is the worthiest that they end at.
    """
    worthy = partial(worth, policy=detector.policy)
    starts = {id(first): (first, *more) for first, *more in candidates}
    waiting = sorted((c[0] for c in candidates), key=worthy, reverse=True)
    done, left, scores = list[Hypothesis](), list[Hypothesis](), dict[int, float]()
    lead, leads_by, count = -np.inf, -np.inf, Counter[str]()
    for h in waiting:
        led = worthy(h) < (1.0 - _behind(h, detector.policy)) * leads_by
        bends = bent(detector, h)
        told_badly = fault_of(h).curved or _saturated(detector, h)
        if (led and not told_badly) or (bends and count[h.batch.kind] >= detector.policy.entrants):
            left.append(h)
            continue
        count[h.batch.kind] += bends
        now = max((exact(detector, y, fitted, s) for s in starts[id(h)]), key=worthy) if bends else h
        if worthy(now) > lead:
            lead = worthy(now)
            leads_by = min(lead, max(worthy(h), (1.0 - detector.policy.saturates) * lead))
        done.append(now)
        scores[id(now)] = worthy(h)
    straight = [h for h in left if not bent(detector, h)]
    return _fair(detector, y, fitted, [*done, *straight], scores), [h for h in left if bent(detector, h)]


def _behind(h: Hypothesis, policy: SearchPolicy) -> float:
    """Share of the leader's score that a hypothesis may lack and overtake it by being refitted."""
    if h.when.windows and h.when.bell is None:
        return policy.switched
    return policy.saturates if fault_of(h).saturates else policy.behind


def tried(
    detector: Detector, y: np.ndarray, fitted: Fitted, candidates: Sequence[Sequence[Hypothesis]]
) -> list[Sequence[Hypothesis]]:
    """Candidates of `judged`, most worthy first. Where a coolant leads, it and others within `saturates` have been
    refitted for some passes, from the last of their starts: a film saturates most at the wetted face, which linearity
    would leave aside."""
    order = sorted(candidates, key=lambda starts: -worth(starts[0], detector.policy))
    if not order or not fault_of(order[0][0]).wets:
        return order
    least = (1.0 - detector.policy.saturates) * worth(order[0][0], detector.policy)
    passed = [
        (exact(detector, y, fitted, starts[-1], detector.policy.trial),)
        if fault_of(starts[0]).wets and worth(starts[0], detector.policy) > least else starts
        for starts in order
    ]  # fmt: skip
    return sorted(passed, key=lambda starts: -worth(starts[0], detector.policy))


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
        behind = detector.policy.saturates if from_description else detector.policy.behind
        least = (1.0 - detector.policy.behind) * worthy(lead)
        score = (1.0 - behind) * scores.get(id(lead), worthy(lead))
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


def _follows(h: Hypothesis) -> bool:
    """Whether a hypothesis acts on readings in proportion to a size that is free."""
    return fault_of(h).read and not fault_of(h).curved and not h.batch.fixed


def _saturated(detector: Detector, h: Hypothesis) -> bool:
    """A conductance that is nearly gone: it moves temperatures by far more than its score says."""
    return fault_of(h).conducts and h.amplitude[0] < detector.policy.gone


def bent(detector: Detector, h: Hypothesis) -> bool:
    fault = fault_of(h)
    return fault.bent or fault.curved or bool(edges_of(detector.study, h))


def exact(detector: Detector, y: np.ndarray, fitted: Fitted, h: Hypothesis, passes: int = 0) -> Hypothesis:
    """A hypothesis with amplitudes, edges in time and statistic of the exact model, the parameters fitted with it.

    y (m,): NaN where nothing was measured. passes: at most, 0 for as many as its kind needs.
    """
    fault, policy = fault_of(h), detector.policy
    if fault.curved:
        return _read_anew(detector, fitted, h)
    study, q, a = detector.study, h.batch.q, np.array(h.amplitude)
    if fault.conducts:  # as if temperatures were linear in t
        a = np.clip(1.0 / np.maximum(1.0 - a, 0.2) - 1.0, policy.lowest_change, policy.highest_change)
    if h.when.bell is not None:
        h = moved(study, detector.elements, h, ())  # hours found by `growth` get their windows
    before, inner = misfit(detector, fitted), edges_of(study, h)
    read = readings_columns(detector, h) if fault.read else np.zeros((len(y), q))
    (low, high), (mean, inverse), floor = bounds(study), fault.prior(q), lowest(detector, h)
    a = np.maximum(a, floor)
    if fault.wets:  # a strong film saturates: a score that takes it as linear says little
        a[0] = mean[0]
    x0 = beginning(fitted.x, policy).copy()
    x0[freed(study, h)] = 0.0
    now = _Point(a, x0, h)
    best, statistic, step, share = now, -np.inf, _Step(np.zeros(q), np.zeros_like(fitted.x), ()), 1.0
    held = policy.held if fault.wets else 0
    for i in range(passes or held + (policy.passes if not inner else policy.window_passes)):
        edges = [inner[(i + j) % len(inner)] for j in range(min(len(inner), K - q))] if inner else []
        outputs, derivatives = _outputs(detector, now, edges)
        J = jacobian(detector, now.x, [(h, float(now.a[0]))])
        projector = detector.fitter.projector(J, fitted.more)
        left = detector.whiten(y - fitted.beside - outputs + J @ now.x) - read @ now.a
        removed = before - float(left @ projector(left)) - float(inverse @ (now.a - mean) ** 2)
        arrived = i > held and abs(removed - statistic) < max(policy.less, policy.less_share * removed)
        if removed <= statistic:  # too far: back, then less; parameters may do without a step
            if arrived:
                break
            if np.any(step.x):
                step = replace(step, x=np.zeros_like(step.x))
            else:
                share *= 0.4
            if share < 0.1:
                break
        else:
            best, statistic, share = now, removed, 1.0
            if arrived:
                break
            derivatives[:, q:] *= [e.per_second for e in edges]
            D = detector.whiten(derivatives) + np.pad(read, ((0, 0), (0, len(edges))))
            PD = projector(D)
            stiff = 1e9 * inverse if i < held else inverse
            F = D.T @ PD + np.diag([*stiff, *(e.prior(policy) ** -2.0 for e in edges)])
            pulled = np.concatenate([stiff * (mean - now.a), np.zeros(len(edges))])
            below = np.concatenate([floor - now.a, np.full(len(edges), -np.inf)])
            found = solved(F, PD.T @ left + pulled, below)
            after = fault.limited(study, h.name, _moved(now.a, found[:q], fault.conducts, h.batch.sign, policy))
            later = np.clip(found[q:], -policy.edge_step, policy.edge_step)
            nuisance = projector.most_likely(left - D @ np.concatenate([after - now.a, later]))[: len(now.x)]
            drift = np.clip(np.clip(nuisance, low, high) - now.x, -policy.near, policy.near)
            step = _Step(after - now.a, 0.0 * drift if i < held else drift, tuple(zip(edges, later, strict=True)))
        shifts = [(e, share * by) for e, by in step.edges]
        shifted = moved(study, detector.elements, best.h, shifts) if shifts else best.h
        now = _Point(best.a + share * step.a, best.x + share * step.x, shifted)
    if fault.vanished(best.a):
        statistic = 0.0
    # what better parameters remove is not the cause's
    _, J = detector.fitter.surrogate.at(best.x)
    none = detector.whiten(y - fitted.beside - study.all_outputs(best.x) + J @ best.x)
    statistic += min(float(none @ detector.fitter.projector(J, fitted.more)(none)) - before, 0.0)
    return replace(best.h, statistic=max(statistic, 0.0), amplitude=tuple(map(float, best.a)))


def _read_anew(detector: Detector, fitted: Fitted, h: Hypothesis) -> Hypothesis:
    """A hypothesis about readings that are not in proportion to its size, at the size that removes most misfit."""
    left = fitted.projector(detector.whiten(fitted.residual))
    size, tried = h.amplitude[0], list[tuple[float, float]]()
    states = motion(detector, beginning(fitted.x, detector.policy))
    for _ in range(detector.policy.read_passes):
        change, D = (detector.whiten(f(detector, h, size, states)) for f in (curved_change, curved_slope))
        kept = left - fitted.projector(change)
        tried.append((float(change @ (left + kept)), size))
        step = float(D @ kept) / max(float(D @ fitted.projector(D)), 1e-30)
        size += float(np.clip(step, -0.5 * abs(size), abs(size)))
        if abs(step) < detector.policy.enough * abs(size):
            break
    statistic, best = max(tried)
    return replace(h, statistic=max(statistic, 0.0), amplitude=(best,))


def beginning(x: np.ndarray, policy: SearchPolicy = POLICY) -> np.ndarray:
    """(n,) parameters from which a cause is refitted: those without it, or the description where it has bent them."""
    return x if np.abs(x).max(initial=0.0) < policy.bends else np.zeros_like(x)


def solved(F: np.ndarray, known: np.ndarray, lowest: np.ndarray) -> np.ndarray:
    """(n,) the minimum of a^T F a / 2 - known . a; what would be below its `lowest` (n,) is held there."""
    held = np.zeros(len(known), dtype=bool)
    while True:
        free = ~held
        found = np.where(held, lowest, 0.0)
        rest = known[free] - F[np.ix_(free, held)] @ found[held]
        found[free] = np.linalg.pinv(F[np.ix_(free, free)], rcond=1e-9, hermitian=True) @ rest
        beyond = found < lowest
        if not beyond.any():
            return np.asarray(found)
        held |= beyond


def lowest(detector: Detector, h: Hypothesis) -> np.ndarray:
    """(q,) below which no amplitude goes."""
    return fault_of(h).lowest(detector.study, detector.nominal, h)


@dataclass(frozen=True)
class _Point:
    a: np.ndarray  # (q,)
    x: np.ndarray  # (n,)
    h: Hypothesis  # with its windows


@dataclass(frozen=True)
class _Step:
    a: np.ndarray
    x: np.ndarray
    edges: tuple[tuple[Edge, float], ...]  # s


def _outputs(detector: Detector, p: _Point, edges: Sequence[Edge]) -> tuple[np.ndarray, np.ndarray]:
    """Outputs (m,) of all fitted runs and their derivatives (m, q + edges) by amplitudes and pulses at edges."""
    study, n = detector.study, len(p.a) + len(edges)
    units = units_of(study, p.h)

    def of_run(k: int) -> tuple[np.ndarray, np.ndarray]:
        if any(u.shapes[k].any() for u in units):
            slots = with_pulses(study, detector.elements, p.h, units, p.a, edges, k)
            return study.by_amplitudes(k, p.x, slots, [*p.a, *np.zeros(len(edges))])
        f = study.outputs(k, p.x)
        return f, np.zeros((len(f), n))

    outputs, derivatives = zip(*over_runs(of_run, study.fitted), strict=True)
    return np.concatenate(outputs), np.vstack(derivatives)


def _moved(a: np.ndarray, step: np.ndarray, relative: bool, sign: int, policy: SearchPolicy = POLICY) -> np.ndarray:
    if relative:
        t = a / (1.0 + a) + step / (1.0 + a) ** 2
        least = np.maximum(policy.lowest_change, (1.0 + a) / 5.0 - 1.0)
        return np.asarray(np.clip(t / np.maximum(1.0 - t, 1e-9), least, policy.highest_change))
    result = np.clip(a + step, a - 2.0 * np.abs(a), a + 2.0 * np.abs(a))
    if sign:
        result[0] = sign * max(sign * result[0], 0.2 * sign * a[0])  # never through zero
    return np.asarray(result)
