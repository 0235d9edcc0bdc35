"""Candidates compared with the exact model before one is named.

A score is exact for what adds heat. What conducts bends: a joint that lost nine tenths of its conductance moves
temperatures nine times as far as its derivative says, and a cause that is wrong but free enough can then score more
than the right one. So those whose response is not linear are refitted, each alone, and compared by the misfit that
they really remove. Conductances move in t = a / (1 + a), in which temperatures are nearly linear.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.fitter import Fitted, bounds
from twin.diagnose.faults.acted import units_of
from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.study import K
from twin.diagnose.search.accepted import curved_change, curved_slope, freed, jacobian
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.edges import STEP, Edge, edges_of, moved, with_pulses
from twin.diagnose.search.growth import GROWTH

PASSES, WINDOW_PASSES, READ_PASSES = 3, 8, 6
ENTRANTS = 5  # candidates of a kind that are refitted
BEHIND = 0.15  # of the leader: who scores less cannot overtake it by being refitted
SATURATES = 0.4  # likewise of capacities and of coolants' films: the larger they are, the worse is linearity
EDGE = 4.0  # likelihood-ratio units that an edge gains where nothing is hidden
GONE = -0.7  # of a relative change, linearly
ENOUGH = 0.02  # of a size, that a pass moves it by when it has arrived
LESS, SHARE = 1.0, 1e-3  # likelihood-ratio units and share of a statistic: a pass that changes less is the last
HELD = 2  # passes in which its heat and edges are found for that film, before all are free
TRIAL = 4  # passes by which coolants are compared before the best of them are refitted
BENDS = 2.5  # prior standard deviations that only something hidden moves a parameter by
NEAR = 1.0  # prior standard deviations: of parameters at the start of a refit, and their longest step
LOW, HIGH = (
    -0.97,
    20.0,
)  # of relative changes: from -0.98 on the integration holds a conductance, and no derivative is left
AMPLITUDE = 8.0  # likelihood-ratio units that a second amplitude costs: of a coolant beside plain heat


def misfit(detector: Detector, fitted: Fitted) -> float:
    """Sum of squares of what a fit leaves, in units of noise and model discrepancy."""
    white = detector.whiten(fitted.residual)
    return float(white @ fitted.projector(white))


def worth(h: Hypothesis) -> float:
    """A statistic less the price of its freedom: how many like it were tried, amplitudes, further windows."""
    tried = len(h.batch.places) * len(h.batch.histories)
    more = max(len(h.when.windows) - 1, 0) if fault_of(h).grows else 0
    return h.statistic - 2.0 * float(np.log(tried)) - AMPLITUDE * (h.batch.q - 1) - GROWTH * more


def proof(detector: Detector, h: Hypothesis) -> float:
    """A refitted statistic as thresholds count it: they know neither edges that are fitted nor further windows."""
    if fault_of(h).read:
        return h.statistic
    more = max(len(h.when.windows) - 1, 0) if fault_of(h).grows else 0
    return h.statistic - EDGE * len(edges_of(detector.study, h)) - (GROWTH - 2.0 * EDGE) * more


def judged(
    detector: Detector, y: np.ndarray, fitted: Fitted, candidates: Sequence[Sequence[Hypothesis]]
) -> tuple[list[Hypothesis], list[Hypothesis]]:
    """Candidates, most worthy first: those whose statistics are exact, and the others.

    Those that are bent or have edges are refitted, until one leads all others by a share of BEHIND: by what both score
    before they are refitted, for windows with fitted edges gain by it what others would gain, too. A candidate may have
    several starts, of which the first has its score: it is the worthiest that they end at.
    """
    starts = {id(first): (first, *more) for first, *more in candidates}
    waiting = sorted((c[0] for c in candidates), key=worth, reverse=True)
    done: list[Hypothesis] = []
    left: list[Hypothesis] = []
    lead, leads_by, count = -np.inf, -np.inf, Counter[str]()
    for h in waiting:
        behind = SATURATES if fault_of(h).saturates else BEHIND
        led = worth(h) < (1.0 - behind) * leads_by
        bent = _bent(detector, h)
        if (led and not _saturated(h)) or (bent and count[h.batch.kind] >= ENTRANTS):
            left.append(h)
            continue
        count[h.batch.kind] += bent
        now = max((exact(detector, y, fitted, s) for s in starts[id(h)]), key=worth) if bent else h
        if worth(now) > lead:
            lead = worth(now)
            leads_by = min(lead, max(worth(h), (1.0 - SATURATES) * lead))
        done.append(now)
    straight = [h for h in left if not _bent(detector, h)]
    return _fair(detector, y, fitted, [*done, *straight]), [h for h in left if _bent(detector, h)]


def tried(
    detector: Detector, y: np.ndarray, fitted: Fitted, candidates: Sequence[Sequence[Hypothesis]]
) -> list[Sequence[Hypothesis]]:
    """Candidates, most worthy first, of `judged`. Where a coolant leads, it and others within SATURATES have been
    refitted for some passes, from the last of their starts: linearity is, for a film that saturates, wrong by
    tens of per cent, more at the wetted face than at those behind it, so that it would be left aside."""
    order = sorted(candidates, key=lambda starts: -worth(starts[0]))
    if not order or not fault_of(order[0][0]).wets:
        return order
    least = (1.0 - SATURATES) * worth(order[0][0])
    passed = [
        (exact(detector, y, fitted, starts[-1], TRIAL),)
        if fault_of(starts[0]).wets and worth(starts[0]) > least else starts
        for starts in order
    ]  # fmt: skip
    return sorted(passed, key=lambda starts: -worth(starts[0]))


def _fair(detector: Detector, y: np.ndarray, fitted: Fitted, candidates: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Candidates, most worthy first. One that leads by its score while another near it was refitted is refitted, too:
    the exact model takes some hundredths from each, and that alone would decide between the two."""
    order, exactly = sorted(candidates, key=worth, reverse=True), set[int]()
    while True:
        lead = order[0]
        near = [h for h in order[1:] if worth(h) > (1.0 - BEHIND) * worth(lead)]
        settled = _bent(detector, lead) or id(lead) in exactly or fault_of(lead).read or lead.batch.fixed
        if settled or not any(_bent(detector, h) or id(h) in exactly for h in near):
            break
        order[0] = exact(detector, y, fitted, lead)
        exactly.add(id(order[0]))
        order.sort(key=worth, reverse=True)
    return order


def _saturated(h: Hypothesis) -> bool:
    """A conductance that is nearly gone: it moves temperatures by far more than its score says."""
    return fault_of(h).conducts and h.amplitude[0] < GONE


def _bent(detector: Detector, h: Hypothesis) -> bool:
    fault = fault_of(h)
    return fault.bent or fault.curved or (not fault.read and bool(edges_of(detector.study, h)))


def exact(detector: Detector, y: np.ndarray, fitted: Fitted, h: Hypothesis, passes: int = 0) -> Hypothesis:
    """A hypothesis with amplitudes, edges in time and statistic of the exact model, the parameters fitted with it.

    y (m,): NaN where nothing was measured. What accepted causes do is added to what it does. passes: at most, 0 for as
    many as its kind needs.
    """
    fault = fault_of(h)
    if fault.curved:
        return _read_anew(detector, fitted, h)
    study, q = detector.study, h.batch.q
    a = np.array(h.amplitude)
    if fault.conducts:
        a = np.clip(1.0 / np.maximum(1.0 - a, 0.2) - 1.0, LOW, HIGH)  # as if temperatures were linear in t
    if h.when.bell is not None:
        h = moved(study, detector.elements, h, ())  # hours found by `growth` get their windows
    before = misfit(detector, fitted)
    inner = edges_of(study, h)
    low, high = bounds(study)
    floor = lowest(detector, h)
    a = np.maximum(a, floor)
    mean, inverse = fault.prior(q)
    if fault.wets:  # a strong film saturates: a score that takes it as linear says little
        a[0] = mean[0]
    x0 = beginning(fitted.x).copy()
    x0[freed(study, h)] = 0.0
    now = _Point(a, x0, h)
    best, statistic, step, share = now, -np.inf, _Step(np.zeros(q), np.zeros_like(fitted.x), ()), 1.0
    held = HELD if fault.wets else 0
    for i in range(passes or held + (PASSES if not inner else WINDOW_PASSES)):
        edges = [inner[(i + j) % len(inner)] for j in range(min(len(inner), K - q))] if inner else []
        outputs, derivatives = _outputs(detector, now, edges)
        J = jacobian(detector, now.x, [(h, float(now.a[0]))])
        projector = detector.fitter.projector(J, fitted.more)
        left = detector.whiten(y - fitted.beside - outputs + J @ now.x)
        removed = before - float(left @ projector(left)) - float(inverse @ (now.a - mean) ** 2)
        arrived = i > held and abs(removed - statistic) < max(LESS, SHARE * removed)
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
            D = derivatives
            D[:, q:] *= [e.per_second for e in edges]
            D = detector.whiten(D)
            PD = projector(D)
            stiff = 1e9 * inverse if i < held else inverse
            F = D.T @ PD + np.diag([*stiff, *(e.prior**-2.0 for e in edges)])
            pulled = np.concatenate([stiff * (mean - now.a), np.zeros(len(edges))])
            below = np.concatenate([floor - now.a, np.full(len(edges), -np.inf)])
            found = solved(F, PD.T @ left + pulled, below)
            after = fault.limited(study, h.name, _moved(now.a, found[:q], fault.conducts, h.batch.sign))
            shifts = np.clip(found[q:], -STEP, STEP)
            nuisance = projector.most_likely(left - D @ np.concatenate([after - now.a, shifts]))[: len(now.x)]
            drift = np.clip(np.clip(nuisance, low, high) - now.x, -NEAR, NEAR)
            step = _Step(after - now.a, 0.0 * drift if i < held else drift, tuple(zip(edges, shifts, strict=True)))
        shifted = (
            moved(study, detector.elements, best.h, [(e, share * by) for e, by in step.edges]) if step.edges else best.h
        )
        now = _Point(best.a + share * step.a, best.x + share * step.x, shifted)
    if fault.vanished(best.a):
        statistic = 0.0
    # what better parameters remove is not the cause's
    plain = np.concatenate([study.outputs(k, best.x) for k in study.fitted])
    _, J = detector.fitter.surrogate.at(best.x)
    none = detector.whiten(y - fitted.beside - plain + J @ best.x)
    statistic += min(float(none @ detector.fitter.projector(J, fitted.more)(none)) - before, 0.0)
    return replace(best.h, statistic=max(statistic, 0.0), amplitude=tuple(map(float, best.a)))


def _read_anew(detector: Detector, fitted: Fitted, h: Hypothesis) -> Hypothesis:
    """A hypothesis about readings that are not in proportion to its size, at the size that removes most misfit."""
    left = fitted.projector(detector.whiten(fitted.residual))
    size, tried, x = h.amplitude[0], list[tuple[float, float]](), beginning(fitted.x)
    for _ in range(READ_PASSES):
        change, D = (detector.whiten(f(detector, h, size, x)) for f in (curved_change, curved_slope))
        kept = left - fitted.projector(change)
        tried.append((float(change @ (left + kept)), size))
        step = float(D @ kept) / max(float(D @ fitted.projector(D)), 1e-30)
        size += float(np.clip(step, -0.5 * abs(size), abs(size)))
        if abs(step) < ENOUGH * abs(size):
            break
    statistic, best = max(tried)
    return replace(h, statistic=max(statistic, 0.0), amplitude=(best,))


def beginning(x: np.ndarray) -> np.ndarray:
    """(n,) parameters from which a cause is refitted: those without it, or the description where it has bent them."""
    return x if np.abs(x).max(initial=0.0) < BENDS else np.zeros_like(x)


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
    outputs, derivatives = [], []
    for k in study.fitted:
        if any(u.shapes[k].any() for u in units):
            slots = with_pulses(study, detector.elements, p.h, units, p.a, edges, k)
            f, D = study.by_amplitudes(k, p.x, slots, [*p.a, *np.zeros(len(edges))])
            derivatives.append(D[:, :n])
        else:
            f = study.outputs(k, p.x)
            derivatives.append(np.zeros((len(f), n)))
        outputs.append(f)
    return np.concatenate(outputs), np.vstack(derivatives)


def _moved(a: np.ndarray, step: np.ndarray, relative: bool, sign: int) -> np.ndarray:
    if relative:
        t = a / (1.0 + a) + step / (1.0 + a) ** 2
        bent = np.where(t < HIGH / (1.0 + HIGH), t / np.maximum(1.0 - t, 1e-9), HIGH)
        return np.asarray(np.clip(bent, np.maximum(LOW, (1.0 + a) / 5.0 - 1.0), HIGH))
    result = np.clip(a + step, a - 2.0 * np.abs(a), a + 2.0 * np.abs(a))
    if sign:
        result[0] = sign * max(sign * result[0], 0.2 * sign * a[0])  # never through zero
    return np.asarray(result)
