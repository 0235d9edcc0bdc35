"""Candidates compared with the exact model before one is named.

A score is exact for what adds heat. What conducts bends: a joint that lost nine tenths of its conductance moves
temperatures nine times as far as its derivative says, and a cause that is wrong but free enough can then score more
than the right one. So those whose response is no straight line are refitted, each alone, and judged by the misfit that
they really remove. Conductances move in t = a / (1 + a), in which temperatures are nearly linear.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.acted import CONDUCTS, READINGS, units_of
from twin.diagnose.batch import Hypothesis
from twin.diagnose.edges import STEP, Edge, edges_of, moved, with_pulses
from twin.diagnose.fitter import Fitted, bounds
from twin.diagnose.growth import GROWTH
from twin.diagnose.study import K
from twin.diagnose.yardstick import Yardstick

BENT = (*CONDUCTS, "film", "group_film", "capacity", "coolant")
PASSES, WINDOW_PASSES = 3, 8
ENTRANTS = 5  # candidates that are refitted
BEHIND = 0.15  # of the leader: who scores less cannot overtake it by being refitted
EDGE = 4.0  # likelihood-ratio units that an edge gains where nothing is hidden
GONE = -0.7  # of a relative change, as a straight line
WET = 30.0  # W/(m^2 K), from which the film of a coolant is refitted at most
NEAR = 1.0  # prior standard deviations: of parameters at the start of a refit, and their longest step
LOW, HIGH = -0.99, 20.0  # of relative changes
AMPLITUDE = 8.0  # likelihood-ratio units that a second amplitude costs: of a coolant beside plain heat


def worth(h: Hypothesis) -> float:
    """A statistic less the price of its freedom: how many like it were tried, amplitudes, further windows."""
    tried = len(h.batch.places) * len(h.batch.histories)
    more = max(len(h.when.windows) - 1, 0) if h.family not in ("sun", "joint") else 0
    return h.statistic - 2.0 * float(np.log(tried)) - AMPLITUDE * (h.batch.q - 1) - GROWTH * more


def proof(yard: Yardstick, h: Hypothesis) -> float:
    """A refitted statistic as thresholds count it: they know neither edges that are fitted nor further windows."""
    if h.batch.kind in READINGS:
        return h.statistic
    more = max(len(h.when.windows) - 1, 0) if h.when.bell is None and h.family != "joint" else 0
    return h.statistic - EDGE * len(edges_of(yard.study, h)) - (GROWTH - 2.0 * EDGE) * more


def judged(
    yard: Yardstick, y: np.ndarray, fitted: Fitted, candidates: Sequence[Hypothesis]
) -> tuple[list[Hypothesis], list[Hypothesis]]:
    """Candidates, most worthy first: those whose statistics are exact, and the others.

    Those that are bent or have edges are refitted, until one leads all others by a share of BEHIND.
    """
    waiting = sorted(candidates, key=worth, reverse=True)
    done: list[Hypothesis] = []
    left: list[Hypothesis] = []
    count = 0
    for h in waiting:
        led = bool(done) and worth(h) < (1.0 - BEHIND) * max(worth(d) for d in done)
        bent = _bent(yard, h)
        if (led and not _saturated(h)) or (bent and count >= ENTRANTS):
            left.append(h)
            continue
        count += bent
        done.append(exact(yard, y, fitted, h) if bent else h)
    straight = [h for h in left if not _bent(yard, h)]
    return sorted([*done, *straight], key=worth, reverse=True), [h for h in left if _bent(yard, h)]


def _saturated(h: Hypothesis) -> bool:
    """A conductance that is nearly gone: it moves temperatures by far more than its score says."""
    return h.batch.kind in CONDUCTS and h.amplitude[0] < GONE


def _bent(yard: Yardstick, h: Hypothesis) -> bool:
    return h.batch.kind in BENT or (h.batch.kind not in READINGS and bool(edges_of(yard.study, h)))


def exact(yard: Yardstick, y: np.ndarray, fitted: Fitted, h: Hypothesis) -> Hypothesis:
    """A hypothesis with amplitudes, edges in time and statistic of the exact model, the parameters fitted with it.

    y (m,): NaN where nothing was measured. What accepted causes do is added to what it does.
    """
    study = yard.study
    relative, q = h.batch.kind in CONDUCTS, h.batch.q
    a = np.array(h.amplitude)
    if relative:
        a = np.clip(1.0 / np.maximum(1.0 - a, 0.2) - 1.0, LOW, HIGH)  # as if temperatures were linear in t
    if h.when.bell is not None:
        h = moved(study, yard.elements, h, ())  # hours found by `growth` get their windows
    none = yard.whiten(fitted.residual)
    before = float(none @ fitted.projector(none))
    inner = edges_of(study, h)
    low, high = bounds(study)
    if h.batch.kind == "coolant":  # a strong film saturates; the heat that it takes does not
        a[0] = min(a[0], WET)
    # a strong cause has bent the calibration: begin near the description
    now = _Point(a, np.clip(fitted.x, -NEAR, NEAR), h)
    best, statistic, step, share = now, -np.inf, _Step(np.zeros(q), np.zeros_like(fitted.x), ()), 1.0
    for i in range(PASSES if not inner else WINDOW_PASSES):
        edges = [inner[(i + j) % len(inner)] for j in range(min(len(inner), K - q))] if inner else []
        outputs, derivatives = _outputs(yard, now, edges)
        _, J = yard.fitter.surrogate.at(now.x)
        projector = yard.fitter.projector(J, fitted.more)
        left = yard.whiten(y - fitted.beside - outputs + J @ now.x)
        removed = before - float(left @ projector(left))
        if removed <= statistic:  # too far: back, and less
            share *= 0.4
            if share < 0.1:
                break
        else:
            best, statistic, share = now, removed, 1.0
            D = derivatives
            D[:, q:] *= [e.per_second for e in edges]
            D = yard.whiten(D)
            PD = projector(D)
            F = D.T @ PD + np.diag([0.0] * q + [e.prior**-2.0 for e in edges])
            found = np.linalg.pinv(F, rcond=1e-9, hermitian=True) @ (PD.T @ left)
            after = _moved(now.a, found[:q], relative, h.batch.sign)
            shifts = np.clip(found[q:], -STEP, STEP)
            nuisance = projector.most_likely(left - D @ np.concatenate([after - now.a, shifts]))[: len(now.x)]
            drift = np.clip(np.clip(nuisance, low, high) - now.x, -NEAR, NEAR)
            step = _Step(after - now.a, drift, tuple(zip(edges, shifts, strict=True)))
        shifted = (
            moved(study, yard.elements, best.h, [(e, share * by) for e, by in step.edges]) if step.edges else best.h
        )
        now = _Point(best.a + share * step.a, best.x + share * step.x, shifted)
    return replace(best.h, statistic=max(statistic, 0.0), amplitude=tuple(map(float, best.a)))


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


def _outputs(yard: Yardstick, p: _Point, edges: Sequence[Edge]) -> tuple[np.ndarray, np.ndarray]:
    """Outputs (m,) of all fitted runs and their derivatives (m, q + edges) by amplitudes and pulses at edges."""
    study, n = yard.study, len(p.a) + len(edges)
    units = units_of(study, p.h)
    outputs, derivatives = [], []
    for k in study.fitted:
        if any(u.shapes[k].any() for u in units):
            slots = with_pulses(study, yard.elements, p.h, units, p.a, edges, k)
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
