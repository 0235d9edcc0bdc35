"""Candidates compared with the exact model before one is named.

A score is exact for what adds heat. What conducts bends: a joint that lost nine tenths of its conductance moves
temperatures nine times as far as its derivative says, and a cause that is wrong but free enough can then score more
than the right one. So those whose response is no straight line are refitted, each alone, and judged by the misfit that
they really remove. Conductances move in t = a / (1 + a), in which temperatures are nearly linear.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twin.diagnose.acted import READINGS, units_of
from twin.diagnose.batch import GROWTH, Hypothesis
from twin.diagnose.edges import PRIOR, STEP, edges_of, moved, per_second, with_pulses
from twin.diagnose.fitter import Fitted
from twin.diagnose.study import K
from twin.diagnose.yardstick import Yardstick

RELATIVE = ("group", "joint", "contact")  # kinds whose amplitude is a relative change of a conductance
BENT = (*RELATIVE, "film", "group_film", "capacity", "coolant")
PASSES, WINDOW_PASSES = 3, 5
ENTRANTS = 5  # bent candidates that are refitted
SHARE = 0.35  # of the best worth that a candidate needs for a refit
LOW, HIGH = -0.95, 20.0  # of relative changes
AMPLITUDE = 8.0  # likelihood-ratio units that a second amplitude costs: of a coolant beside plain heat


def worth(h: Hypothesis) -> float:
    """A statistic less the price of its freedom: how many like it were tried, amplitudes, further windows."""
    tried = len(h.batch.places) * len(h.batch.histories)
    more = max(len(h.when.windows) - 1, 0) if h.family not in ("sun", "joint") else 0
    return h.statistic - 2.0 * float(np.log(tried)) - AMPLITUDE * (h.batch.q - 1) - GROWTH * more


def judged(yard: Yardstick, y: np.ndarray, fitted: Fitted, candidates: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Candidates, those of the most worthy refitted that are bent or have edges in time; most worthy first."""
    if not candidates:
        return []
    ordered = sorted(candidates, key=worth, reverse=True)
    least = SHARE * worth(ordered[0])
    kinds: set[tuple[str, str]] = set()
    result = []
    for h in ordered:
        key = (h.family, h.batch.kind)
        asked = h.batch.kind in BENT or (edges_of(yard.study, h) and h.batch.kind not in READINGS)
        if asked and key not in kinds and len(kinds) < ENTRANTS and worth(h) > least:
            kinds.add(key)
            h = exact(yard, y, fitted, h)
        result.append(h)
    return sorted(result, key=worth, reverse=True)


def exact(yard: Yardstick, y: np.ndarray, fitted: Fitted, h: Hypothesis) -> Hypothesis:
    """A hypothesis with the amplitudes, the edges in time and the statistic of the exact model; parameters react to
    first order.

    y (m,): NaN where nothing was measured.
    """
    study = yard.study
    relative, q = h.batch.kind in RELATIVE, h.batch.q
    a = np.array(h.amplitude)
    if relative:
        a = np.clip(1.0 / np.maximum(1.0 - a, 0.2) - 1.0, LOW, HIGH)  # as if temperatures were linear in t
    none = yard.whiten(fitted.residual)
    before = float(none @ fitted.projector(none))
    without = y - fitted.residual + fitted.J @ fitted.x  # outputs without the cause; NaN where nothing was measured
    target = y + fitted.J @ fitted.x
    inner = edges_of(study, h)
    found, best = h, replace(h, statistic=0.0)
    for i in range(PASSES if not inner else WINDOW_PASSES):
        edges = [inner[(i + j) % len(inner)] for j in range(min(len(inner), K - q))] if inner and q < K else []
        units = units_of(study, yard.elements, yard.index, found)
        n = q + len(edges)
        outputs, derivatives = [], []
        first = 0
        for k in study.fitted:
            own = slice(first, first + study.runs[k].size)
            first = own.stop
            if any(u.shapes[k].any() for u in units):
                slots = with_pulses(study, yard.elements, found, units, a, edges, k)
                f, D = study.by_amplitudes(k, fitted.x, slots, [*a, *np.zeros(len(edges))])
                outputs.append(f)
                derivatives.append(D[:, :n])
            else:
                outputs.append(without[own])
                derivatives.append(np.zeros((own.stop - own.start, n)))
        left = yard.whiten(target - np.concatenate(outputs))
        removed = before - float(left @ fitted.projector(left))
        worse = removed < best.statistic
        if not worse:
            best = replace(found, statistic=max(removed, 0.0), amplitude=tuple(map(float, a)))
        if worse and not edges:
            break
        D = np.vstack(derivatives)
        D[:, q:] *= [per_second(e) for e in edges]
        D = yard.whiten(D)
        PD = fitted.projector(D)
        F = D.T @ PD + np.diag([0.0] * q + [PRIOR**-2.0] * len(edges))
        step = np.linalg.pinv(F, rcond=1e-9, hermitian=True) @ (PD.T @ left)
        a = _moved(a, step[:q], relative, h.batch.sign)
        if edges:
            shifts = np.clip(step[q:], -STEP, STEP)
            found = moved(study, found, list(zip(edges, shifts, strict=True)))
    return best


def _moved(a: np.ndarray, step: np.ndarray, relative: bool, sign: int) -> np.ndarray:
    if relative:
        t = a / (1.0 + a) + step / (1.0 + a) ** 2
        bent = np.where(t < HIGH / (1.0 + HIGH), t / np.maximum(1.0 - t, 1e-9), HIGH)
        return np.asarray(np.clip(bent, np.maximum(LOW, (1.0 + a) / 5.0 - 1.0), HIGH))
    result = a + step
    if sign:
        result[0] = sign * max(sign * result[0], 0.2 * sign * a[0])  # never through zero
    return np.asarray(result)
