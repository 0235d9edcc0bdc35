"""A hypothesis refitted with the exact model, the parameters beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.fitter import Fitted, bounds
from twin.diagnose.faults.acted import units_of
from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.over_runs import over_runs
from twin.diagnose.model.study import K
from twin.diagnose.search.accepted import curved_change, curved_slope, freed, jacobian, motion, readings_columns, strong
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.edges import Edge, edges_of, moved, with_pulses
from twin.diagnose.search.policy import POLICY, SearchPolicy


def misfit(detector: Detector, fitted: Fitted) -> float:
    """Sum of squares of what a fit leaves, in units of noise and model discrepancy; where the description says that one
    can leave less, this: what better parameters remove is no cause's."""
    return min(float(misfit_of_each(detector, fitted).sum()), fitted.reachable)


def misfit_of_each(detector: Detector, fitted: Fitted) -> np.ndarray:
    """(m,) what each number has in that sum."""
    return detector.whiten(fitted.residual) * unexplained(detector, fitted)


def unexplained(detector: Detector, fitted: Fitted) -> np.ndarray:
    """(m,) the white residual less what calibration, model discrepancy and causes explain."""
    return np.asarray(fitted.projector(detector.whiten(fitted.residual)))


def by_chance(y: np.ndarray, policy: SearchPolicy) -> float:
    """The misfit that noise in measurements y (m,), NaN where missing, leaves in all but a thousandth of cases."""
    count = int(np.isfinite(y).sum())
    return count + policy.chance * float(np.sqrt(2.0 * count))


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


def exact(detector: Detector, y: np.ndarray, fitted: Fitted, h: Hypothesis, passes: int = 0) -> Hypothesis:
    """A hypothesis with amplitudes, edges in time and statistic of the exact model, the parameters fitted with it.

    y (m,): NaN where nothing was measured. passes: at most, 0 for as many as its kind needs.
    """
    if fault_of(h).curved:
        return _read_anew(detector, y, fitted, h)
    policy = detector.policy
    a = np.array(h.amplitude)
    if fault_of(h).conducts:  # as if temperatures were linear in t
        a = np.clip(1.0 / np.maximum(1.0 - a, 0.2) - 1.0, policy.lowest_change, policy.highest_change)
    if fault_of(h).wets:  # a strong film saturates: a score that takes it as linear says little
        a[0] = fault_of(h).prior(h.batch.q)[0][0]
    if h.when.bell is not None:
        h = moved(detector.study, detector.elements, h, ())  # hours found by `growth` get their windows
    x = beginning(fitted.x, policy).copy()
    x[freed(detector.study, h)] = 0.0
    return _descended(detector, y, fitted, _Point(a, x, h), passes, held=policy.held if fault_of(h).wets else 0)


def closer(detector: Detector, y: np.ndarray, fitted: Fitted, h: Hypothesis) -> Hypothesis:
    """A hypothesis that has been compared, where it is strong: once its edges have been tried nearby, with derivatives
    of the exact model beside it, and by what the parameters that are reached leave. Unchanged where that explains no
    more.

    Every step otherwise counts what the most likely parameters of the linear model would leave: far from the minimum
    even a wrong linear model explains nearly all, and one of several strong causes leads by that alone.
    """
    if fault_of(h).curved or not strong(detector, h):
        return h
    begun = edges_tried(detector, y, fitted, h)
    return max(h, reached(detector, y, fitted, begun), key=lambda own: own.statistic)


def edges_tried(detector: Detector, y: np.ndarray, fitted: Fitted, h: Hypothesis) -> Hypothesis:
    """A refitted hypothesis with its edges, one after the other, where they explain most some quarters of an hour
    earlier or later, at its size, also where they begin or end with a run. What an edge does at a light part is over
    within minutes, and derivatives see none farther off."""
    study, policy = detector.study, detector.policy
    whole = [Edge(what, i) for i in range(len(h.when.windows)) for what in ("begin", "end")]
    edges = whole if h.when.bell is None else edges_of(study, h)
    if not edges:
        return h
    a, x = np.array(h.amplitude), beginning(fitted.x, policy)
    J = jacobian(detector, x, [(h, a)], closely=False)
    projector, there = detector.fitter.projector(J, fitted.more), y - fitted.beside + J @ x

    def left(own: Hypothesis) -> float:
        white = detector.whiten(there - _outputs(detector, _Point(a, x, own), ())[0])
        return float(white @ projector(white))

    best, least, before = h, left(h), np.inf
    while least < before - policy.less:
        before = least
        for edge in edges:
            shifts = [(edge, by * policy.edge_step) for by in (-1.0, -0.5, 0.5, 1.0)]
            tried = [moved(study, detector.elements, best, [shift]) for shift in shifts]
            remains, found = min(((left(own), own) for own in tried), key=lambda own: own[0])
            best, least = (found, remains) if remains < least else (best, least)
    return best


def reached(detector: Detector, y: np.ndarray, fitted: Fitted, h: Hypothesis) -> Hypothesis:
    """A hypothesis that has been compared, by what the parameters that are reached leave; unchanged where its size is
    known or does not act in proportion."""
    if fault_of(h).curved or h.batch.fixed:
        return h
    x = beginning(fitted.x, detector.policy).copy()
    return _descended(detector, y, fitted, _Point(np.array(h.amplitude), x, h), detector.policy.window_passes, True)


def _descended(
    detector: Detector, y: np.ndarray, fitted: Fitted, now: _Point, passes: int, closely: bool = False, held: int = 0
) -> Hypothesis:
    """Where Gauss-Newton steps with a line search from a point end; held: first passes, that leave amplitudes of which
    more is known beforehand and the parameters where they are."""
    study, policy, h = detector.study, detector.policy, now.h
    fault, q = fault_of(h), h.batch.q
    before, inner = misfit(detector, fitted), edges_of(study, h)
    read = readings_columns(detector, h) if fault.read else np.zeros((len(y), q))
    (low, high), (mean, inverse), floor = bounds(study), fault.prior(q), lowest(detector, h)
    a = np.maximum(now.a, floor)
    now = replace(now, a=a)
    best, statistic, step, share = now, -np.inf, _Step(np.zeros(q), np.zeros_like(now.x), ()), 1.0

    def limited(at: _Point, found: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        a = fault.limited(study, h.name, _moved(at.a, found[:q], fault.conducts, h.batch.sign, policy))
        return a, np.clip(found[q:], -policy.edge_step, policy.edge_step)

    others = detector.fitter.without_parameters(fitted.more) if closely else None
    for i in range(passes or held + (policy.passes if not inner else policy.window_passes)):
        edges = [inner[(i + j) % len(inner)] for j in range(min(len(inner), K - q))] if inner else []
        outputs, derivatives = _outputs(detector, now, edges)
        J = jacobian(detector, now.x, [(now.h, now.a)], closely)
        projector = detector.fitter.projector(J, fitted.more)
        if fault.moves:
            read = detector.whiten(curved_change(detector, h, 1.0, motion(detector, now.x)))[:, None]
        there = detector.whiten(y - fitted.beside - outputs) - read @ now.a
        left = there + detector.whiten(J @ now.x)
        if others is None:
            remains = float(left @ projector(left))
        else:
            remains = float(there @ others(there)) + float(now.x @ now.x)
        removed = before - remains - float(inverse @ (now.a - mean) ** 2)
        enough = max(policy.less, policy.less_share * (remains if closely else removed))
        arrived = i > held and abs(removed - statistic) < enough
        if removed <= statistic:  # too far: back, then less; parameters may do without a step
            if arrived:
                break
            if np.any(step.x) and not closely:
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
            prior = np.diag([*stiff, *(e.prior(policy) ** -2.0 for e in edges)])
            pulled = np.concatenate([stiff * (mean - now.a), np.zeros(len(edges))])
            below = np.concatenate([floor - now.a, np.full(len(edges), -np.inf)])
            found = solved(D.T @ PD + prior, PD.T @ left + pulled, below)
            after, later = limited(now, found)
            nuisance = projector.most_likely(left - D @ np.concatenate([after - now.a, later]))[: len(now.x)]
            wanted = np.clip(nuisance, low, high) - now.x
            # all by the same share: parameters that make up for each other are far from it when each is cut alone
            drift = wanted * min(1.0, policy.near / max(float(np.abs(wanted).max()), policy.near))
            if others is not None:  # the best for parameters that get no farther
                PD = others(D)
                found = solved(D.T @ PD + prior, PD.T @ (there - detector.whiten(J @ drift)) + pulled, below)
                after, later = limited(now, found)
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


def _read_anew(detector: Detector, y: np.ndarray, fitted: Fitted, h: Hypothesis) -> Hypothesis:
    """A hypothesis about readings that are not in proportion to its size, at the size that removes most misfit."""
    there = unbent(detector, y, fitted)
    less = left_less(detector, there, fitted)
    left = unexplained(detector, there)
    size, tried = h.amplitude[0], list[tuple[float, float]]()
    states = motion(detector, beginning(there.x, detector.policy))
    for _ in range(detector.policy.read_passes):
        change, D = (detector.whiten(f(detector, h, size, states)) for f in (curved_change, curved_slope))
        kept = left - there.projector(change)
        tried.append((float(change @ (left + kept)) - less, size))
        step = float(D @ kept) / max(float(D @ there.projector(D)), 1e-30)
        size += float(np.clip(step, -0.5 * abs(size), abs(size)))
        if abs(step) < detector.policy.enough * abs(size):
            break
    statistic, best = max(tried)
    return replace(h, statistic=max(statistic, 0.0), amplitude=(best,))


def beginning(x: np.ndarray, policy: SearchPolicy = POLICY) -> np.ndarray:
    """(n,) parameters from which a cause is refitted: those without it, or the description where it has bent them."""
    return np.zeros_like(x) if bends(x, policy) else x


def bends(x: np.ndarray, policy: SearchPolicy) -> bool:
    """Whether a fit has bent parameters (n,) towards a cause that none of them is."""
    return bool(np.abs(x).max(initial=0.0) >= policy.bends)


def unbent(detector: Detector, y: np.ndarray, fitted: Fitted) -> Fitted:
    """A fit of measurements y (m,); where it has bent parameters and no cause is named yet, the description instead."""
    bent = bends(fitted.x, detector.policy) and fitted.more is None
    return detector.fitter.at_description(y) if bent else fitted


def left_less(detector: Detector, there: Fitted, fitted: Fitted) -> float:
    """By how much less misfit a fit leaves than what begins there: that is no cause's."""
    return max(misfit(detector, there) - misfit(detector, fitted), 0.0)


def solved(F: np.ndarray, known: np.ndarray, lowest: np.ndarray) -> np.ndarray:
    """(n,) the minimum of a^T F a / 2 - known . a; what would be below its `lowest` (n,) is held there."""
    held = np.zeros(len(known), dtype=bool)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(F), 1e-30))  # seconds stand beside shares of a conductance
    F, known = F * np.outer(scale, scale), known * scale
    lowest = lowest / scale
    while True:
        free = ~held
        found = np.where(held, lowest, 0.0)
        rest = known[free] - F[np.ix_(free, held)] @ found[held]
        found[free] = np.linalg.pinv(F[np.ix_(free, free)], rcond=1e-9, hermitian=True) @ rest
        beyond = found < lowest
        if not beyond.any():
            return np.asarray(scale * found)
        held |= beyond


def lowest(detector: Detector, h: Hypothesis) -> np.ndarray:
    """(q,) below which no amplitude goes."""
    return fault_of(h).lowest(detector.study, detector.nominal, h)


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
