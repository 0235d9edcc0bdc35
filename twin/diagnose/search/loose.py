"""Declared numbers out of their tolerance, by two calibrations.

The fit that finds causes is efficient and takes for a number what its model has wrong; the settled one is not misled so
easily, and sure of less.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.linalg

from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.fitter import Fitted
from twin.diagnose.evidence.pulls import Loose
from twin.diagnose.evidence.settled import settled_alone
from twin.diagnose.faults.loss_law import is_source
from twin.diagnose.faults.table import family_of_parameter, fault_of
from twin.diagnose.search.accepted import Accepted
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.policy import SearchPolicy


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
    sure of no film of a heavy body and of no small source, but not biased; the latter is, and takes for a joint what
    another mesh makes of it. So where it alone is sure it is to be as sure as any cause has to be.
    """
    policy, strain, found = detector.policy, detector.pulls.strain(fitted.x, settled), list[Loose]()
    beside = np.ones(len(strain))  # strain once the farthest is free
    for j in (int(j) for j in np.argsort(-strain) if strain[j] >= 1.0):
        if j not in known.settled:
            known.settled[j] = settled_alone(detector.fitter, y, (j,))
        x, covariance = known.settled[j]
        sigma, (alone, spread) = float(np.sqrt(covariance[j, j])), untied(fitted, j)
        told, follows = alone**2 / (1.0 + spread**2), bool(beside[j] < 1.0)  # beside its prior N(0, 1)
        robust = Loose(j, float(x[j]), sigma, float(strain[j]), told=told, follows=follows)
        efficient = replace(robust, x=alone, sigma=spread, settled=False)
        sure = max(policy.sure, float(np.sqrt(detector.least)))
        out = [own for own in (robust, efficient) if np.sign(fitted.x[j]) * own.x > policy.outside]
        if robust in out and abs(robust.x) > sure * robust.sigma:
            found.append(replace(robust, rivals=_signals(detector, robust)))
        elif efficient in out and _as_sure_as_any(detector, fitted, efficient, robust):
            found.append(replace(efficient, rivals=_signals(detector, efficient)))
        if len(found) == policy.far:
            break
        if found and found[0].index == j:
            beside = detector.pulls.strain(beside_free(fitted, j), x)
    return tuple(found)


def _as_sure_as_any(detector: Detector, fitted: Fitted, efficient: Loose, robust: Loose) -> bool:
    """Whether data alone tell a number from the declared one as surely as any cause of its family has to be told, and
    the robust estimate does not refute that.

    A source of a third of its size has a third of its derivative by the logarithm: it is surer by its size.
    """
    parameter, x = detector.study.probed.parameters[efficient.index], float(fitted.x[efficient.index])
    scale = float(detector.study.scale[efficient.index])
    sure = abs(efficient.x) / efficient.sigma
    if is_source(parameter):
        by_size = abs(np.expm1(scale * efficient.x)) / (np.exp(scale * x) * scale * efficient.sigma)
        sure = max(sure, float(by_size))
    enough = sure**2 > detector.thresholds[family_of_parameter(parameter)]
    return enough and not _contradicted(efficient, robust, detector.policy)


def _contradicted(efficient: Loose, robust: Loose, policy: SearchPolicy) -> bool:
    """Whether the 95 % interval of a robust estimate excludes even `alone` of an efficient one (Hausman, Econometrica
    46, 1978, on two estimates of which one alone suffers from what is misspecified)."""
    toward = float(np.sign(efficient.x))
    return toward * robust.x + policy.sure * robust.sigma < policy.alone * abs(efficient.x)


def untied(fitted: Fitted, j: int) -> tuple[float, float]:
    """A parameter as the fit has it without its tolerance, to first order, and its standard deviation.

    Of a posterior N(x, v) under the prior N(0, 1), the data alone say N(x / (1 - v), v / (1 - v)).
    """
    variance = variance_of(fitted, j)
    return float(fitted.x[j]) / (1.0 - variance), float(np.sqrt(variance / (1.0 - variance)))


def variance_of(fitted: Fitted, j: int) -> float:
    """Of a parameter beside all nuisances, in prior variances: below 1."""
    return min(float(_covariance(fitted, j)[j]), 1.0 - 1e-12)


def beside_free(fitted: Fitted, j: int) -> np.ndarray:
    """(n,) parameters as the fit has them where one of them has no tolerance, to first order."""
    covariance, x = _covariance(fitted, j)[: len(fitted.x)], untied(fitted, j)[0]
    return fitted.x + covariance * (x - float(fitted.x[j])) / covariance[j]


def _covariance(fitted: Fitted, j: int) -> np.ndarray:
    """(n + q,) of a parameter with all nuisances."""
    unit = np.zeros(len(fitted.projector.factor[0]))
    unit[j] = 1.0
    return np.asarray(scipy.linalg.cho_solve(fitted.projector.factor, unit))


def _signals(detector: Detector, own: Loose) -> tuple[tuple[Hypothesis, float], ...]:
    """Exact factors of signals that warm what a source warms, by as much as its number without a tolerance says; with
    the source's own statistic, as they do the same."""
    if not is_source(detector.study.probed.parameters[own.index]):
        return ()
    policy, scale = detector.policy, float(detector.study.scale[own.index])
    return tuple(
        (replace(h, statistic=own.strain**2), cosine) for h, cosine, heat in factors_of(detector, own.index)
        if abs(cosine) >= policy.same and heat > 0.0
        and abs(np.log(heat) - scale * own.x) < policy.sure * scale * own.sigma
    )  # fmt: skip


def factors_of(detector: Detector, j: int) -> Iterator[tuple[Hypothesis, float, float]]:
    """Exact factors of signals: with the cosine of what each and a declared number do, and times what heat, were that
    number a source's, each multiplies it by."""
    own = detector.whiten(detector.fitter.linear(np.zeros(len(detector.study.scale)))[1][:, j])
    own = own / detector.study.scale[j]
    size = float(own @ own)
    for batch in (b for b in detector.columns.batches if fault_of(b).corrects):
        for i in range(len(batch.places)):
            signal = detector.columns.raw[:, batch.columns[i, 0]].astype(float)
            along = float(signal @ own)
            cosine = along / np.sqrt(max(size * float(signal @ signal), 1e-30))
            yield Hypothesis(batch, i, batch.histories[0], 0.0, (1.0,)), float(cosine), 1.0 + along / size
