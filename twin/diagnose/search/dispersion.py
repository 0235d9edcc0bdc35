"""A search that knows how poor the model is: thresholds grow with what even the best explanation leaves.

Of m measured numbers with white residual r, after the named causes and the strongest unknown heat,

    c = r^T Pi r / m

is about 1 where noise and model discrepancy are all that is left: the expectation of r^T Pi r is m, as Pi is the
inverse of the covariance of r (the dispersion of McCullagh, Nelder, Generalized Linear Models, 1989, section 4.5;
c-hat of Burnham, Anderson, Model Selection and Multimodel Inference, 2002, section 2.5). A model with a larger c is
wrong in its form, and of what it leaves some cause explains a large share by chance. Then it must explain more than
all that is left.

Dividing every statistic by c, as those books do, was tried and is not enough: what a form leaves lasts for hours, so
that one place may explain half of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.evidence.pulls import Spread
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.forward import search
from twin.diagnose.search.look import Search


@dataclass(frozen=True)
class Dispersion:
    """Of what the best explanation leaves."""

    left: float  # r^T Pi r
    share: float  # c: of every measured number


def searched(detector: Detector, y: np.ndarray) -> tuple[Search, Dispersion]:
    """Causes in measurements y (m,) of the fitted runs, NaN where something is missing, and the dispersion of the
    first search: where it is large, what is found is that of a second one whose thresholds (`Search.detector`) grew."""
    found = search(detector, y)
    own = dispersion_of(found)
    return (search(raised(detector, own), y) if own.share > detector.policy.dispersed else found), own


def dispersion_of(found: Search) -> Dispersion:
    """Of a search. Unknown heat that passes is an explanation, too."""
    heat = max(found.steps[-1].parts.values(), default=0.0)
    left = found.left - (heat if heat > found.detector.thresholds["unknown"] else 0.0)
    return Dispersion(left, left / found.measured)


def raised(detector: Detector, own: Dispersion) -> Detector:
    """The detector of a model with that dispersion: no threshold below all that is left, and parameters that may be
    moved by the root of it farther."""
    thresholds = {name: max(value, own.left) for name, value in detector.thresholds.items()}
    farther = float(np.sqrt(own.share))
    fitted, settled = (_wider(s, farther) for s in (detector.pulls.fitted, detector.pulls.settled))
    return replace(detector, thresholds=thresholds, pulls=replace(detector.pulls, fitted=fitted, settled=settled))


def _wider(spread: Spread, times: float) -> Spread:
    return replace(spread, limit=times * spread.limit)
