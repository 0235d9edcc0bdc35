"""Detection limits: the smallest sizes that would have been named in 95 of 100 cases in these data.

A cause is named by its statistic, from (sqrt(threshold) + z) / sqrt(I) on, with I the information about its size after
everything calibratable is projected out. A declared number is named by calibration as well, which moves it: with the
tolerance s as its prior, and t = ln(factor) / s its true value, a fit says x = (1 - v) t, and without the tolerance
x / (1 - v) = t, of the variances v (1 - v) and v / (1 - v), where

    1 - v = s^2 I

as its own tolerance is among what is projected out of I (`loose.loose_ones` says from which x on it is out).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from twin.diagnose.evidence.batch import Batch, History, Hypothesis
from twin.diagnose.evidence.sight import sight
from twin.diagnose.evidence.whiten import Projector
from twin.diagnose.faults.table import fault_of
from twin.diagnose.result.diagnosis import Limit
from twin.diagnose.search.accepted import curved_change, motion, parameter_of
from twin.diagnose.search.detector import Detector


def limits_in(detector: Detector) -> Iterator[tuple[Batch, np.ndarray]]:
    """Of every batch whose size is free (p, h): the amplitude that would have been named in 95 of 100 cases, at each
    place with each history; infinite where no machine can have one so large."""
    f, _, projector = detector.fitter.linear(np.zeros(len(detector.study.probed.parameters)))
    for own in sight(detector.columns, projector, np.zeros(len(f))).ready:
        batch = own.batch
        if batch.fixed:
            continue
        if fault_of(batch).curved:
            sizes = _curved(detector, batch, deviations_needed(detector, batch), projector)
        else:
            sizes = np.stack(
                [seen_from(detector, batch, p, told, batch.histories) for p, told in enumerate(own.information)]
            )
        most = np.array(batch.largest or (np.inf,))[:, None]
        yield batch, np.where(sizes > most, np.inf, np.maximum(sizes, batch.smallest))


def deviations_needed(detector: Detector, batch: Batch) -> float:
    """Standard deviations of a size at which 95 of 100 measurements pass the threshold of its family."""
    return float(np.sqrt(detector.thresholds[batch.family])) + detector.policy.power


def seen_from(
    detector: Detector, batch: Batch, place: int, information: np.ndarray, histories: Sequence[History]
) -> np.ndarray:
    """(h,) the amplitude that would have been named in 95 of 100 cases, of its information (h,) with some histories."""
    sizes = deviations_needed(detector, batch) / np.sqrt(np.maximum(information, 1e-30))
    j = parameter_of(detector.study, batch.places[place]) if fault_of(batch).declared else None
    if j is None:
        return np.asarray(sizes)
    return np.minimum(sizes, [
        np.inf if h.windows or h.signal else _by_calibration(detector, batch, j, float(told))
        for h, told in zip(histories, information, strict=True)
    ])  # fmt: skip


def _by_calibration(detector: Detector, batch: Batch, j: int, information: float) -> float:
    """From which amplitude on the fit that finds causes moves the declared number j out of its tolerance, in 95 of 100
    cases; the settled calibration may see it earlier, and is not counted."""
    policy, scale, threshold = detector.policy, float(detector.study.scale[j]), detector.thresholds[batch.family]
    certain = float(np.clip(scale**2 * information, 1e-12, 1.0))  # 1 - v
    sigma = np.sqrt((1.0 - certain) / certain)
    out = max(float(detector.pulls.fitted.limit[j]) / certain, policy.outside, float(np.sqrt(threshold)) * sigma)
    change = scale * float(out + policy.power * sigma)
    return fault_of(batch).amplitude(change)[0] if change < np.log(np.finfo(float).max) else np.inf


def _curved(detector: Detector, batch: Batch, needed: float, projector: Projector) -> np.ndarray:
    """(p, 1) from which on what is not in proportion to its size is `needed` standard deviations, at every size that is
    tried: a sensor that lags by a quarter of an hour may look more like a declared number than one that lags by two
    minutes, whose derivative says that both are seen."""
    tried = fault_of(batch).sizes
    sizes = np.geomspace(batch.smallest, max(map(abs, tried)), detector.policy.limit_sizes)
    signs = sorted({float(np.sign(s)) for s in tried})
    states, result = motion(detector, None), np.full((len(batch.places), 1), np.inf)
    for i in range(len(batch.places)):
        of = Hypothesis(batch, i, batch.histories[0], 0.0, (1.0,))
        changes = [curved_change(detector, of, sign * size, states) for size in sizes for sign in signs]
        D = detector.whiten(np.column_stack(changes))
        seen = (D * projector(D)).sum(axis=0).reshape(len(sizes), -1).min(axis=1) >= needed**2
        first = len(sizes) - int(np.argmin([*seen[::-1], False]))
        if first < len(sizes):
            result[i] = sizes[first]
    return result


def over_histories(histories: Sequence[History], sizes: np.ndarray) -> np.ndarray:
    """(...,) what stands for the limits (..., h) of so many histories, all of which switch or none does.

    The median. Where every one follows a signal the largest, as which of them it will be is not known: their median may
    be a third of what the one that acts needs.
    """
    follow = all(h.signal for h in histories)
    return np.asarray(sizes.max(axis=-1) if follow else np.median(sizes, axis=-1))


def limits_at(detector: Detector) -> dict[tuple[str, str, str, bool], float]:
    """(family, unit, place, whether it switches) -> `limits_in`, `over_histories`, the least of batches."""
    result: dict[tuple[str, str, str, bool], float] = {}
    for batch, sizes in limits_in(detector):
        if fault_of(batch).beside:
            continue
        for windowed in (False, True):
            chosen = [i for i, h in enumerate(batch.histories) if bool(h.windows) == windowed]
            if chosen:
                told = over_histories([batch.histories[i] for i in chosen], sizes[:, chosen])
                for name, size in zip(batch.places, told.tolist(), strict=True):
                    key = (batch.family, batch.unit, name, windowed)
                    result[key] = min(size, result.get(key, np.inf))
    return result


def limits_of(detector: Detector) -> tuple[Limit, ...]:
    """Per family and unit `limits_at` its places, for what always acts where there is such; factors as factors."""
    told = [batch for batch in detector.columns.batches if not fault_of(batch).beside]
    curves = {(batch.family, batch.unit): fault_of(batch).curve for batch in told}
    at = limits_at(detector)
    found: dict[tuple[str, str], list[tuple[float, str]]] = {}
    for (family, unit, place, windowed), size in at.items():
        if not windowed or (family, unit, place, False) not in at:
            found.setdefault((family, unit), []).append((size, place))
    limits = []
    for (family, unit), sizes in found.items():
        ordered = sorted(sizes)
        median, place = ordered[len(ordered) // 2]
        size, smallest, largest = (curves[family, unit].told(s) for s in (median, ordered[0][0], ordered[-1][0]))
        limits.append(Limit(family, place, size, smallest, largest, unit))
    return tuple(limits)
