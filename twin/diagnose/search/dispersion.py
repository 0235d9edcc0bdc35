"""A search that knows how poor the model is: what even the best explanation leaves decides what a cause must explain.

Of m measured numbers with white residual r, after the named causes and the strongest unknown heat,

    c = r^T Pi r / m

is about 1 where noise and model discrepancy are all that is left: the expectation of r^T Pi r is m, with a standard
deviation of (2 m)^(1/2), as Pi is the inverse of the covariance of r (the dispersion of McCullagh, Nelder, Generalized
Linear Models, 1989, section 4.5; c-hat of Burnham, Anderson, Model Selection and Multimodel Inference, 2002, section
2.5). More than that is an error of the model's form, and a cause explains a share of it by chance: it must explain
more than a quarter of the excess, r^T Pi r - m.

Where c is above 3 the model is too poor for that. What is left then becomes model discrepancy of its own, a slow error
of every channel (`twin.diagnose.search.slow_errors`), and a cause must explain more than half of what is left beside
these. Heat of any history alone is not told: a model wrong in its form leaves that. Where nothing is named, the verdict
is "too poor", with the calibration of a search without slow errors, from which the note tells what is missing.

Dividing every statistic by c, as those books do, was tried and is not enough: what a form leaves lasts for hours, so
that one place may explain half of it. Nor is "more than all that is left" without slow errors: what a single channel
leaves is then held against every cause, and sizes that would pass are beyond what a machine can have.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.faults.acted import units_of
from twin.diagnose.faults.table import fault_of
from twin.diagnose.search.accepted import Accepted
from twin.diagnose.search.contest import beginning, misfit, worth
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.forward import search
from twin.diagnose.search.look import Search, look
from twin.diagnose.search.policy import SearchPolicy
from twin.diagnose.search.refit import refit
from twin.diagnose.search.slow_errors import slow_errors, with_errors


@dataclass(frozen=True)
class Dispersion:
    """Of what the best explanation leaves."""

    left: float  # r^T Pi r
    measured: int  # m
    heat: bool  # unknown heat is in that explanation
    errors: np.ndarray | None = None  # (m, q) white: slow errors of single channels, where the model is poor
    beside: float = 0.0  # r^T Pi r with slow errors in Pi

    @property
    def share(self) -> float:
        """c"""
        return self.left / self.measured

    def least(self, policy: SearchPolicy) -> float:
        """What a cause must explain at least; 0 where noise and model discrepancy are all that is left."""
        if self.errors is not None:
            return policy.beside * self.beside
        excess = self.left - self.measured
        return policy.excess * excess if excess > policy.chance * math.sqrt(2.0 * self.measured) else 0.0


def searched(detector: Detector, y: np.ndarray) -> tuple[Search, Dispersion]:
    """Causes in measurements y (m,) of the fitted runs, NaN where something is missing, and the dispersion of the
    first search: where that is no chance, what is found is that of another one whose thresholds grew (`raised`)."""
    first = search(detector, y)
    own = dispersion_of(first)
    if own.share > detector.policy.dispersed:
        own = _with_errors(own, detector, y)
        found = search(raised(detector, own), y)
        return (found if found.accepted else search(_closed(detector), y)), own
    return (search(raised(detector, own), y) if own.least(detector.policy) else first), own


def dispersion_of(found: Search) -> Dispersion:
    """Of a search. Unknown heat that passes is an explanation, too."""
    heat = max(found.steps[-1].parts.values(), default=0.0)
    passes = heat > found.detector.thresholds["unknown"]
    left = float(found.left.sum()) - (heat if passes else 0.0)
    return Dispersion(left, int(np.isfinite(found.residual).sum()), passes)


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
        named = Accepted(h, units_of(detector.study, h), size, np.eye(h.batch.q), h.statistic, 0.0, ())
        plain = refit(detector, y, beginning(plain.x, detector.policy), [named])[0]
    return replace(own, errors=slow_errors(detector, plain), beside=misfit(wide, fitted) - most)


def wrong_temperatures(found: Search) -> bool:
    """Whether temperatures alone make a model poor: then nothing can be told of what they move."""
    study = found.detector.study
    shapes = [study.runs[k].shapes for k in study.fitted]
    temperatures = np.concatenate([np.repeat([True, False], [b * s, 3 * rows]) for (b, s), (rows, _) in shapes])
    return found.detector.poor or found.dispersion(temperatures) > found.detector.policy.dispersed


def raised(detector: Detector, own: Dispersion) -> Detector:
    """The detector of a model with that dispersion: no threshold below what a cause must explain."""
    least = own.least(detector.policy)
    wide = detector if own.errors is None else with_errors(detector, own.errors)
    return replace(wide, least=least, thresholds={name: max(v, least) for name, v in wide.thresholds.items()})


def _closed(detector: Detector) -> Detector:
    """The detector that names nothing."""
    return replace(detector, least=math.inf, thresholds=dict.fromkeys(detector.thresholds, math.inf))
