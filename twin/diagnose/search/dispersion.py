"""A search that knows how poor the model is: thresholds grow with what even the best explanation leaves.

Of m measured numbers with white residual r, after the named causes and the strongest unknown heat,

    c = r^T Pi r / m

is about 1 where noise and model discrepancy are all that is left: the expectation of r^T Pi r is m, with a standard
deviation of (2 m)^(1/2), as Pi is the inverse of the covariance of r (the dispersion of McCullagh, Nelder, Generalized
Linear Models, 1989, section 4.5; c-hat of Burnham, Anderson, Model Selection and Multimodel Inference, 2002, section
2.5). More than that is an error of the model's form, and a cause explains a share of it by chance: it must explain
more than a quarter of the excess, r^T Pi r - m; in a model so poor that c is above 3, more than all that is left.

Dividing every statistic by c, as those books do, was tried and is not enough: what a form leaves lasts for hours, so
that one place may explain half of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.search.detector import Detector
from twin.diagnose.search.forward import search
from twin.diagnose.search.look import Search
from twin.diagnose.search.policy import SearchPolicy


@dataclass(frozen=True)
class Dispersion:
    """Of what the best explanation leaves."""

    left: float  # r^T Pi r
    measured: int  # m
    heat: bool  # unknown heat is in that explanation

    @property
    def share(self) -> float:
        """c"""
        return self.left / self.measured

    def least(self, policy: SearchPolicy) -> float:
        """What a cause must explain at least; 0 where noise and model discrepancy are all that is left."""
        if self.share > policy.dispersed:
            return self.left
        excess = self.left - self.measured
        return policy.excess * excess if excess > policy.chance * math.sqrt(2.0 * self.measured) else 0.0


def searched(detector: Detector, y: np.ndarray) -> tuple[Search, Dispersion]:
    """Causes in measurements y (m,) of the fitted runs, NaN where something is missing, and the dispersion of the
    first search: where that is no chance, what is found is that of a second one whose thresholds grew (`raised`)."""
    found = search(detector, y)
    own = dispersion_of(found)
    return (search(raised(detector, own), y) if own.least(detector.policy) else found), own


def dispersion_of(found: Search) -> Dispersion:
    """Of a search. Unknown heat that passes is an explanation, too."""
    heat = max(found.steps[-1].parts.values(), default=0.0)
    passes = heat > found.detector.thresholds["unknown"]
    left = float(found.left.sum()) - (heat if passes else 0.0)
    return Dispersion(left, int(np.isfinite(found.residual).sum()), passes)


def wrong_temperatures(found: Search) -> bool:
    """Whether temperatures alone make a model poor: then nothing can be told of what they move."""
    study = found.detector.study
    shapes = [study.runs[k].shapes for k in study.fitted]
    temperatures = np.concatenate([np.repeat([True, False], [b * s, 3 * rows]) for (b, s), (rows, _) in shapes])
    return found.dispersion(temperatures) > found.detector.policy.dispersed


def raised(detector: Detector, own: Dispersion) -> Detector:
    """The detector of a model with that dispersion: no threshold below what a cause must explain."""
    least = own.least(detector.policy)
    return replace(detector, least=least, thresholds={name: max(v, least) for name, v in detector.thresholds.items()})
