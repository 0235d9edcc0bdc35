"""What a search begins with: the fit without a cause, what is seen at a glance, numbers out of their tolerance.

A fit without a cause may bend parameters towards a strong one by many standard deviations. Derivatives there say little
of the machine: where it has, hypotheses are scored at the description, and against what that fit leaves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.fitter import Fitted
from twin.diagnose.evidence.pulls import Loose
from twin.diagnose.evidence.sight import Sight
from twin.diagnose.evidence.whiten import Projector
from twin.diagnose.faults.table import fault_of
from twin.diagnose.search.accepted import settled
from twin.diagnose.search.declared import (
    declared_candidates,
    declared_exactly,
    misplaced_candidates,
    swapped_candidates,
)
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.exact import bends, exact, left_less, unbent
from twin.diagnose.search.hotter import hotter
from twin.diagnose.search.look import Step, distinct, look, scored
from twin.diagnose.search.loose import Freed, loose_ones

Glance = tuple[Sight, list[Hypothesis], Step]
Alone = tuple[Sight, dict[tuple[str, str, str], Hypothesis]]  # the best of every family, place and kind


@dataclass(frozen=True)
class Start:
    """What is known before anything is named."""

    detector: Detector  # with the model discrepancy of what gets hotter than described
    fitted: Fitted
    x0: np.ndarray  # (n,) settled without a cause
    covariance: np.ndarray  # (n, n) of it
    scored: Glance  # all hypotheses
    declared: list[Hypothesis]
    glance: Glance  # with the exact fits of those that are declared
    alone: Alone | None  # where nothing else is at work, if the fit has bent parameters
    loose: tuple[Loose, ...]
    freed: Freed


def afresh(detector: Detector) -> Detector:
    """The detector with no derivatives yet: a diagnosis is the same whatever was searched before."""
    return replace(detector, derivatives=[])


def begun(described: Detector, y: np.ndarray) -> Start:
    """What a search of measurements y (m,) begins with."""
    fitted = described.fitter(y)
    if (detector := hotter(described, fitted.x)) is not described:
        fitted = detector.fitter(y)
    x0, covariance = settled(detector, y, ())
    declared = [*declared_candidates(detector, y, fitted), *swapped_candidates(detector, y, fitted)]
    known, freed = scored(detector, fitted), Freed()
    first = look(detector, fitted, declared, known)
    straight = _from_description(detector, y, fitted)
    alone = _alone(detector, y) if straight else None
    glance = _with(straight, declared) if straight else first
    loose = loose_ones(detector, y, fitted, x0, freed)
    if loose or any(h.statistic > detector.thresholds[h.family] for h in glance[1]):  # without, no cause is named
        factors = declared_exactly(detector, y, fitted)
        exact = {h.name: h for h in (*factors, *misplaced_candidates(detector, y, fitted))}
        # an exact fit ends where it cannot reach half a threshold: of what promises less to first order it says nothing
        told = {h.name: h for h in declared if h.statistic < 0.5 * detector.thresholds[h.family]}
        exact |= {name: told[name] for name, h in exact.items() if name in told and h.statistic <= 0.0}
        declared = [h for h in ({h.name: h for h in declared} | exact).values() if h.statistic > 0.0]
        if straight:
            glance = _with((straight[0], _unfitted(straight[1], factors), straight[2]), declared)
        else:
            glance = look(detector, fitted, declared, (known[0], _unfitted(known[1], factors)))
    if loose or bends(fitted.x, detector.policy):
        glance = _with(glance, _saturated(detector, y, fitted, glance[1]))
    return Start(detector, fitted, x0, covariance, first, declared, glance, alone, loose, freed)


def _from_description(detector: Detector, y: np.ndarray, fitted: Fitted) -> Glance | None:
    """What is seen at the description, where the fit without a cause has bent parameters and something passes there.
    Statistics count against what that fit leaves, where it is less."""
    if (there := unbent(detector, y, fitted)) is fitted:
        return None
    less = left_less(detector, there, fitted)
    seen, ranked, step = look(detector, there)
    own = [replace(h, statistic=h.statistic - less) for h in ranked if h.statistic > less]
    if not any(h.statistic > detector.thresholds[h.family] for h in own):
        return None
    return seen, own, replace(step, parts={part: evidence - less for part, evidence in step.parts.items()})


def _saturated(detector: Detector, y: np.ndarray, fitted: Fitted, ranked: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Exact fits of the most likely ones that saturate and whose scores are between half of their threshold and all of
    it. A number that has taken most of what they do leaves them a score by the derivative that tells a part."""
    likely = [
        h for h in ranked
        if fault_of(h).saturates and 0.5 < h.statistic / detector.thresholds[h.family] < 1.0
    ]  # fmt: skip
    return [exact(detector, y, fitted, h) for h in likely[: detector.policy.closely]]


def _alone(detector: Detector, y: np.ndarray) -> Alone:
    """Scores at the description where nothing else is at work. A cause that bends parameters overwhelms tolerances and
    model discrepancy alike: beside those it scores as well in the hours in which it does not act, with parameters that
    no machine has."""
    nothing = np.zeros((len(y), 1))
    bare = replace(detector, columns=detector.columns.beside(nothing))
    seen, found = scored(bare, replace(detector.fitter.at_description(y), projector=Projector.of(nothing)))
    return seen, {(h.family, h.name, h.batch.kind): h for h in sorted(found, key=lambda h: h.statistic)}


def _unfitted(scores: Sequence[Hypothesis], fitted: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Scores but those of what was fitted exactly: far from the description the score of a factor says little."""
    known = {(h.family, h.name) for h in fitted}
    return [h for h in scores if (h.family, h.name) not in known]


def _with(glance: Glance, declared: Sequence[Hypothesis]) -> Glance:
    """What is seen, and the fits of what is declared among it."""
    seen, ranked, step = glance
    return seen, distinct(sorted([*ranked, *declared], key=lambda h: -h.statistic)), step
