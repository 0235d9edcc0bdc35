"""A search that knows how poor the model is: what even the best explanation leaves decides what a cause must explain.

Of m measured numbers with white residual r, after the named causes and the strongest unknown heat,

    c = r^T Pi r / m

is 1 with a standard deviation of (2 / m)^(1/2) where noise and model discrepancy are all that is left, as Pi is the
inverse covariance of r (dispersion: McCullagh, Nelder, Generalized Linear Models, 1989, section 4.5; c-hat: Burnham,
Anderson, Model Selection and Multimodel Inference, 2002, section 2.5). More is an error of the model's form, and
thresholds are c times as high. Above 3 it becomes model discrepancy of its own (slow errors, below), and a cause must
explain more than half of what is left beside that; heat of any history is not told then.

A channel may leap by more than its noise from one reading to the next, as a sensor at a screw does when the nut passes.
That is its noise, and it weighs as its own mean square says: every other channel would need as much more otherwise, and
the fit would follow it (variances of groups of measurements, estimated from what a fit leaves: Searle, Casella,
McCulloch, Variance Components, 1992, chapter 6). What a form leaves in a channel for hours one place may explain half
of, and a cause must explain more.

Slow errors last for hours and are far larger in some channels than in others. Of the white numbers w of a channel in a
run, less what calibration explains, mean square and product of neighbours say

    cov(w_i, w_j) = [i = j] + v rho^|i - j|,    v = <w_i^2> - 1,    v rho = <w_i w_(i+1)>

a first-order autoregression beside the noise, whose leading modes become nuisances (estimated generalised least
squares: Greene, Econometric Analysis, 2012, section 9.3; a model discrepancy that is learned from what is left:
Kennedy, O'Hagan, J. R. Statist. Soc. B 63, 2001). A cause that is hidden in what is left makes slow errors large, and
hides itself: so they are learned twice, the second time beside what explains most beside the first ones.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy.linalg

from twin.diagnose.evidence.fitter import Fitted
from twin.diagnose.faults.table import fault_of
from twin.diagnose.search.accepted import as_scored
from twin.diagnose.search.any_heat import Entering, entering
from twin.diagnose.search.contest import worth
from twin.diagnose.search.detector import FLOOR, Detector, weighted
from twin.diagnose.search.exact import beginning, closer, exact, misfit, misfit_of_each, unexplained
from twin.diagnose.search.forward import naming, search, search_again
from twin.diagnose.search.look import Search, look
from twin.diagnose.search.paths import otherwise
from twin.diagnose.search.policy import POLICY, SearchPolicy
from twin.diagnose.search.refit import refit
from twin.diagnose.search.start import Start, afresh, begun


@dataclass(frozen=True)
class Dispersion:
    """Of what the best explanation leaves."""

    left: float  # r^T Pi r
    measured: int  # m
    heat: bool  # unknown heat is in that explanation
    errors: np.ndarray | None = None  # (m, q) white: slow errors of single channels, where the model is poor
    beside: float = 0.0  # r^T Pi r with slow errors in Pi
    weight: np.ndarray | None = None  # (m,) of the numbers: what leaps weighs less (`weights_of`); None: all alike
    lasting: float = np.inf  # of r^T Pi r beyond m, in channels where neighbours are alike beyond chance

    @property
    def share(self) -> float:
        """c"""
        return self.left / self.measured

    def least(self, policy: SearchPolicy) -> float:
        """What a cause must explain at least; 0 where noise and model discrepancy are all that is left."""
        if self.errors is not None:
            return policy.excess * self.beside
        excess = self.left - self.measured
        if excess <= policy.chance * math.sqrt(2.0 * self.measured):
            return 0.0
        return max(policy.excess * min(self.lasting, excess), FLOOR * self.share)


def searched(detector: Detector, y: np.ndarray) -> tuple[Search, Dispersion]:
    """Causes in measurements y (m,) of the fitted runs, NaN where something is missing, and the dispersion of the
    first search, of channels as they leap: where that is no chance, causes must explain more (`raised`). What one path
    of heat explains better is that (`paths`)."""
    found, own = _searched(detector, y)
    return otherwise(found, y, own.least(detector.policy) > 0.0), own


def _searched(detector: Detector, y: np.ndarray) -> tuple[Search, Dispersion]:
    described = detector = afresh(detector)
    start = begun(detector, y)
    first, weight = search(detector, y, start), np.ones(len(y))
    for _ in range(detector.policy.weighings):
        now = weights_of(first, weight)
        if np.array_equal(now < 1.0, weight < 1.0):
            break
        weight, detector = now, weighted(described, now)
        start = begun(detector, y)
        first = search(detector, y, start)
    own, alone = dispersion_of(first), tuple[Entering, ...]()
    if own.heat or own.share > detector.policy.dispersed:
        alone = _heat_alone(start, y, own.measured)
    if rather := _explains_more(alone, start, first):
        first = replace(
            first, x=start.x0, accepted=(), steps=start.glance[2:], fitted=start.fitted, entering=alone,
            covariance=start.covariance,
        )  # fmt: skip
        own = dispersion_of(first)
    own = replace(own, weight=weight)
    if own.share > detector.policy.dispersed:
        poor = _with_errors(own, detector, y)
        wide = raised(described, poor)
        found = search(wide, y, begun(wide, y))
        if (heat := explained_by_heat(first)) > 0.0:
            closest = _closely(detector, y, first, found, heat)
            if closest is not None and not _explains_more(alone, start, closest):
                return closest, replace(dispersion_of(closest), weight=weight)
            return first, replace(own, left=float(first.left.sum()) - heat, heat=True)
        return (found if found.accepted else search_again(detector, y, start, first, math.inf)), poor
    if not (least := own.least(detector.policy)):
        return first, own
    if rather:  # a number that heat explains better than is not tested again
        return replace(first, detector=start.detector.at_least(least)), own
    return search_again(detector, y, start, first, least), own


def _heat_alone(start: Start, y: np.ndarray, measured: int) -> tuple[Entering, ...]:
    """Heat of any history in y (m,) with nothing named, at a second place also where that has little of it, if one
    place leaves more than `dispersed` per measured number."""
    detector, policy, (seen, _, step) = start.detector, start.detector.policy, start.glance
    enter = partial(entering, detector, y, start.fitted, seen, step.parts, policy.entering)
    heat = enter()
    left = misfit(detector, start.fitted) - _evidence(heat)
    return enter(share=policy.misfit) if left > policy.dispersed * measured else heat


def _explains_more(heat: Sequence[Entering], start: Start, found: Search) -> bool:
    """Whether heat alone has more evidence than all that a search has named explains, with the heat that this has left
    (beside a freed number by the hour). A name needs nine tenths of what heat explains: of many thousand units the
    tenth is far more than noise leaves, and one window may tell nine tenths of what changes for hours."""
    detector = start.detector
    left = max([_evidence(found.entering), *found.steps[-1].parts.values()])
    named = misfit(detector, start.fitted) - misfit(detector, found.fitted) + left
    return bool(heat) and _evidence(heat) > named + detector.policy.close


def _evidence(heat: Sequence[Entering]) -> float:
    return sum(own.evidence for own in heat)


def _closely(detector: Detector, y: np.ndarray, first: Search, found: Search, heat: float) -> Search | None:
    """The first search with the cause that was named beside slow errors, fitted without them; None where that explains
    less than `covers` of what heat of any history does."""
    policy = detector.policy
    if not found.accepted:
        return None
    named = max(found.accepted, key=lambda a: a.statistic)
    h = closer(detector, y, first.fitted, exact(detector, y, first.fitted, named.hypothesis))
    if h.statistic < policy.covers * heat:
        return None
    one = replace(as_scored(detector.study, h, detector.thresholds[h.family]), rivals=named.rivals)
    return naming(first, y, first.fitted.x, [one])


def dispersion_of(found: Search) -> Dispersion:
    """Of a search. Unknown heat that passes is an explanation, too."""
    heat = max(found.steps[-1].parts.values(), default=0.0)
    passes = heat > found.detector.thresholds["unknown"]
    left = float(found.left.sum()) - (heat if passes else 0.0)
    measured = int(np.isfinite(found.residual).sum())
    return Dispersion(left, measured, passes, lasting=_lasting(found))


def explained_by_heat(found: Search) -> float:
    """What heat of any history explains where slow errors of single channels are less likely, else 0 (Bayes factor:
    Kass, Raftery, J. Am. Stat. Assoc. 90, 1995). Of heat at one surface they hold the misfits of the response, too; two
    surfaces are free enough to explain the errors of few channels. It may leave as much as a number out of its
    tolerance may, since no block is as short as a switch."""
    policy, evidence = found.detector.policy, _evidence(found.entering)
    left = float(found.left.sum())
    misfits = policy.misfit * evidence if len(found.entering) == 1 else 0.0
    better = left - misfit(found.detector, found.fitted)  # parameters, which neither of the two is
    if not evidence or evidence + misfits + better < _evidence_of_errors(found.detector, found.fitted):
        return 0.0
    excess = left - int(np.isfinite(found.residual).sum())
    return evidence + float(np.clip(excess - evidence, 0.0, (1.0 - policy.covers) * evidence))


def _evidence_of_errors(detector: Detector, fitted: Fitted) -> float:
    """Twice the logarithm of that for slow errors of single channels, as learned from what a fit has left."""
    errors, white = slow_errors(detector, fitted), detector.whiten(fitted.residual)
    seen = fitted.projector(errors)
    factor = scipy.linalg.cho_factor(np.eye(errors.shape[1]) + errors.T @ seen, lower=True)
    known = seen.T @ white
    return float(known @ scipy.linalg.cho_solve(factor, known)) - 2.0 * float(np.log(np.diag(factor[0])).sum())


def weights_of(found: Search, weight: np.ndarray) -> np.ndarray:
    """(m,) of the measured numbers, from what a search with weights (m,) leaves. A channel that leaps by more than its
    noise from one reading to the next has that as its noise. All weigh 1 where no more leaps than lasts, or than the
    response to a cause is wrong by: that is an error of the model."""
    result, leaps, policy = np.ones_like(weight), 0.0, found.detector.policy
    for channel in _channels(found.detector, found.residual):
        w = found.unexplained[channel] / weight[channel]
        excess = float(w @ w) - len(w)
        if excess > policy.chance * math.sqrt(2.0 * len(w)) and not _alike(w, policy):
            result[channel] = math.sqrt(len(w) / float(w @ w))
            leaps += excess
    named = policy.misfit * max((a.statistic for a in found.accepted), default=0.0)
    return result if leaps > _lasting(found) + named else np.ones_like(weight)


def _lasting(found: Search) -> float:
    """Sum of w^2 - 1 of the channels whose white numbers w are like their neighbours beyond chance."""
    total, policy = 0.0, found.detector.policy
    for channel in _channels(found.detector, found.residual):
        w = found.unexplained[channel]
        if _alike(w, policy):
            total += max(float(w @ w) - len(w), 0.0)
    return total


def _alike(w: np.ndarray, policy: SearchPolicy) -> bool:
    """Whether white numbers (n,) are like their neighbours beyond chance: of independent ones the sum of products of
    neighbours has a standard deviation of n^(1/2)."""
    return bool(w[1:] @ w[:-1] > policy.chance * math.sqrt(len(w)))


def _channels(detector: Detector, residual: np.ndarray) -> Iterator[np.ndarray]:
    """The measured numbers (n,) of every channel in every run; residual (m,)."""
    measured = np.isfinite(residual)
    for _, *numbers in detector.study.split(np.arange(len(residual))):
        yield from (channel[measured[channel]] for own in numbers for channel in own.T)


def _with_errors(own: Dispersion, detector: Detector, y: np.ndarray) -> Dispersion:
    """With slow errors, learned beside what explains most, and what that leaves."""
    plain = detector.fitter(y)
    wide = with_errors(detector, slow_errors(detector, plain))
    fitted = wide.fitter(y)
    _, ranked, step = look(wide, fitted)
    most = max([*step.parts.values(), *(h.statistic for h in ranked[:1])], default=0.0)
    for h in sorted(ranked, key=lambda h: -worth(h, detector.policy))[:1]:
        size = np.array(h.amplitude)
        if fault_of(h).conducts:  # no score ends at zero
            size[0] = max(size[0], detector.policy.lowest_change)
        named = replace(as_scored(detector.study, h), amplitude=size)
        plain = refit(detector, y, beginning(plain.x, detector.policy), [named])[0]
    return replace(own, errors=slow_errors(detector, plain), beside=float(misfit_of_each(wide, fitted).sum()) - most)


def wrong_temperatures(found: Search) -> bool:
    """Whether temperatures alone make a model poor: then nothing can be told of what they move."""
    temperatures = found.detector.study.joined(lambda _: (True, False))
    return found.detector.poor or found.dispersion(temperatures) > found.detector.policy.dispersed


def raised(detector: Detector, own: Dispersion) -> Detector:
    """The detector of a model with that dispersion: no threshold below what a cause must explain."""
    wide = detector if own.weight is None or own.weight.min() == 1.0 else weighted(detector, own.weight)
    wide = wide if own.errors is None else with_errors(wide, own.errors)
    return wide.at_least(own.least(detector.policy))


def slow_errors(detector: Detector, fitted: Fitted) -> np.ndarray:
    """(m, q) white, each of unit prior variance: what a fit has left, as slow errors of single channels."""
    left = unexplained(detector, fitted)
    blocks = [np.zeros((len(left), 0))]
    for at in _channels(detector, fitted.residual):
        modes = modes_of(left[at], detector.policy)
        block = np.zeros((len(left), modes.shape[1]))
        block[at] = modes
        blocks.append(block)
    return np.hstack(blocks)


def modes_of(left: np.ndarray, policy: SearchPolicy = POLICY) -> np.ndarray:
    """(n, q) of the white numbers (n,) that are left of a channel in a run."""
    n = len(left)
    more = float(left @ left) / max(n, 1) - 1.0
    if n < policy.slow_rows or more <= 0.0:
        return np.zeros((n, 0))
    rho = float(np.clip(left[1:] @ left[:-1] / ((n - 1) * more), 0.0, policy.slow_longest))
    variance, modes = np.linalg.eigh(more * rho ** np.abs(np.subtract.outer(np.arange(n), np.arange(n))))
    kept = variance > policy.slow_least
    return np.asarray(modes[:, kept] * np.sqrt(variance[kept]))


def with_errors(detector: Detector, errors: np.ndarray) -> Detector:
    """The detector of a poor model: with slow errors (m, q) in its model discrepancy."""
    others = np.hstack([detector.fitter.others, errors])
    fitter = replace(detector.fitter, others=others)
    return replace(detector, fitter=fitter, columns=detector.columns.beside(others), poor=True)
