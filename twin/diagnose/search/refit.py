"""All accepted causes fitted with the exact model, together with the parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from twin.diagnose.evidence.consistency import sizes as sizes_by_run
from twin.diagnose.evidence.fitter import Fitted, bounds
from twin.diagnose.evidence.formal import of_channels
from twin.diagnose.faults.acted import slots_with
from twin.diagnose.faults.fault import Curve
from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.over_runs import over_runs
from twin.diagnose.model.study import K, Study
from twin.diagnose.search.accepted import (
    Accepted,
    curved_change,
    curved_slope,
    exchanged,
    freed,
    gains_of,
    jacobian,
    motion,
    readings_columns,
    shifted,
    spans,
    strong,
    untied_beside,
)
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.edges import shape_errors
from twin.diagnose.search.exact import by_chance, lowest, solved
from twin.diagnose.search.policy import SearchPolicy


def refit(
    detector: Detector, y: np.ndarray, x: np.ndarray, accepted: Sequence[Accepted]
) -> tuple[Fitted, list[Accepted]]:
    """Parameters and all amplitudes with the exact model. The residual has the accepted causes in its projector."""
    study, fitter, policy = detector.study, detector.fitter, detector.policy
    low, high = bounds(study)
    units = [u for a in accepted for u in a.units]
    open_shapes = [
        u for a in accepted if a.units for u in shape_errors(study, a.hypothesis, a.units, a.amplitude, policy)
    ]
    open_shapes = open_shapes[: K - len(units)]
    acting = [*units, *open_shapes]
    slots = {k: slots_with(study, detector.elements, acting, k) for k in study.fitted} if units else {}
    # amplitudes in the order of the accepted: those of slots are stepped, those of readings are linear
    stepped = np.concatenate([np.full(len(a.amplitude), bool(a.units)) for a in accepted])
    amplitude = np.concatenate([a.amplitude for a in accepted])
    D = np.zeros((len(y), len(amplitude)))
    y = exchanged(study, y, accepted)
    swapped = np.concatenate([np.full(len(a.amplitude), fault_of(a.hypothesis).exchanges) for a in accepted])
    gains, of_each = gains_of(study, accepted), spans(accepted)
    priors = [fault_of(a.hypothesis).prior(len(a.amplitude)) for a in accepted]
    mean, inverse_prior = (np.concatenate(p) for p in zip(*priors, strict=True))
    floor = np.concatenate([lowest(detector, a.hypothesis) for a in accepted])
    held = [j for a in accepted for j in freed(study, a.hypothesis)]
    x, untied = x.copy(), np.ones(len(x))
    x[held] = 0.0
    untied[untied_beside(study, accepted)] = policy.wide

    def of_runs(x: np.ndarray, a: Sequence[float]) -> list[tuple[np.ndarray, np.ndarray]]:
        return over_runs(lambda k: study.by_amplitudes(k, x, slots[k], a), study.fitted)

    misfit, rises, least = np.inf, 0, np.inf
    best: Any = None  # the pass with the least misfit, at the parameters and amplitudes that it began with
    # the surrogate's derivatives, until strong causes leave more than chance: others take as long as a calibration
    closely, begun = False, (x, amplitude)
    closer = any(strong(detector, a.hypothesis) for a in accepted)
    J, passes = np.zeros((len(y), len(x))), policy.refits
    while passes:
        passes -= 1
        there = shifted(study, x, gains, amplitude)
        sizes = [(a.hypothesis, amplitude[own]) for a, own in zip(accepted, of_each, strict=True)]
        J = jacobian(detector, x, sizes, closely)
        now_named = [replace(a, amplitude=amplitude[own]) for a, own in zip(accepted, of_each, strict=True)]
        bent, states = np.zeros(len(y)), motion(detector, there, now_named)
        for a, own in zip(accepted, of_each, strict=True):
            fault = fault_of(a.hypothesis)
            if fault.stepped:
                size = float(amplitude[own][0])
                slope = curved_slope(detector, a.hypothesis, size, states)
                D[:, own] = detector.whiten(slope)[:, None]
                bent += size * slope - curved_change(detector, a.hypothesis, size, states)
            elif fault.exchanges:  # `exchanged` has left nothing of it
                D[:, own] = 0.0
            elif not a.units:
                D[:, own] = readings_columns(detector, a.hypothesis)
        for q, j in gains:  # a parameter beyond its prior: its own column, per unit of the amplitude
            D[:, q] = detector.whiten(fitter.surrogate.at(there)[1][:, [j]])[:, 0] / study.scale[j]
        if units:
            now = [*amplitude[stepped], *np.zeros(len(open_shapes))]
            parts = of_runs(there, now)
            f = np.concatenate([p for p, _ in parts])
            every = np.vstack([d for _, d in parts])
            exact, shapes = every[:, : len(units)], every[:, len(units) :]
            D[:, stepped] = detector.whiten(exact)
        else:
            f = study.all_outputs(there)
            exact = shapes = np.zeros((len(y), 0))
        if best is not None and not np.isfinite(f).all():  # a step too far for the model: the best one before counts
            misfit = np.inf
            break
        residual = y - f + J @ x + exact @ amplitude[stepped] + bent
        white = detector.whiten(residual)
        for q, _ in gains:
            white = white + D[:, q] * amplitude[q]
        errors = np.hstack([_own_errors(study, D, accepted, amplitude), detector.whiten(shapes)])
        projector = fitter.projector(J * untied, errors)
        PD = projector(D)
        F = D.T @ PD + np.diag(inverse_prior)
        found = solved(F, PD.T @ white + inverse_prior * mean, floor)
        nuisance = np.clip(untied * projector.most_likely(white - D @ found)[: len(x)], low, high)
        step = float((np.abs(found - amplitude) * np.sqrt(np.maximum(np.diag(F), 0.0))).max(initial=0.0))
        left = white - D @ amplitude
        before, misfit = misfit, float(left @ projector(left))
        if closer and not closely and misfit > by_chance(y, policy):
            closely, passes, (x, amplitude) = True, policy.refits, begun
            misfit, rises, least, best = np.inf, 0, np.inf, None
            continue
        if misfit < least:
            least, best = misfit, (x, amplitude, J, D.copy(), F, errors, residual, f, there, white)
        x, amplitude = nuisance, np.where(swapped, 1.0, _limited(found, amplitude, accepted, policy))
        # parameters that the data hardly determine drift on for long, and nothing gets better
        rises = rises + 1 if misfit > before + policy.refit_less else 0
        if (step < policy.still and misfit > before - policy.refit_less) or rises == policy.rises:
            break
    if misfit > least + policy.refit_less:  # it has not arrived: what curves strongly swings about
        x, amplitude, J, D, F, errors, residual, f, there, white = best
        projector = fitter.projector(J * untied, errors)
    inverse = np.linalg.pinv(F)
    alone = sizes_by_run(projector.N, D, white, study.rows, [own.start for own in of_each])
    result = [
        replace(a, amplitude=amplitude[own], covariance=inverse[own, own], by_run=by_run)
        for a, by_run, own in zip(accepted, alone, of_each, strict=True)
    ]
    more = np.hstack([policy.wide * D * np.sqrt(np.maximum(np.diag(inverse), 0.0)), errors])
    bare = study.all_outputs(there) if units else f
    return Fitted(x, J, residual, fitter.projector(J * untied, more), f - bare, more), result


def _own_errors(study: Study, D: np.ndarray, accepted: Sequence[Accepted], amplitude: np.ndarray) -> np.ndarray:
    """(m, k) white: what channels may show of causes in the machine beside what the model says."""
    stepped = [own for a, own in zip(accepted, spans(accepted), strict=True) if a.units]
    return np.hstack([np.zeros((len(D), 0)), *(of_channels(study, D[:, own] @ amplitude[own]) for own in stepped)])


def _limited(found: np.ndarray, before: np.ndarray, accepted: Sequence[Accepted], policy: SearchPolicy) -> np.ndarray:
    """Amplitudes after a step; factors move by their logarithms, of which a step is no longer than `longest`."""
    result = found.copy()
    for a, own in zip(accepted, spans(accepted), strict=True):
        first = own.start
        fault, old, new = fault_of(a.hypothesis), before[first], found[first]
        if fault.curve is Curve.RELATIVE:
            old = max(old, policy.lowest_change)  # what a score says beyond it would be an exchange the wrong way
            step = np.clip((new - old) / (1.0 + old), -policy.longest, policy.longest)
            result[first] = max((1.0 + old) * np.exp(step) - 1.0, policy.lowest_change)
        elif fault.curve is Curve.LOGARITHM:
            result[first] = np.clip(new, old - policy.longest, old + policy.longest)
        elif fault.curved:
            result[first] = np.clip(new, old - 0.5 * abs(old), old + 0.5 * abs(old))
    return result
