"""All hypotheses at one fit, and what a whole search has seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.linalg

from twin.diagnose.evidence.batch import Hypothesis, best, score
from twin.diagnose.evidence.fitter import Fitted
from twin.diagnose.evidence.pulls import Loose
from twin.diagnose.evidence.sight import Sight, sight
from twin.diagnose.evidence.unknown import evidence
from twin.diagnose.evidence.whiten import Projector
from twin.diagnose.faults.lost import lost_candidates
from twin.diagnose.faults.table import fault_of
from twin.diagnose.search.accepted import Accepted, curved_change, motion, readings_columns
from twin.diagnose.search.any_heat import Entering
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.exact import unexplained
from twin.diagnose.search.policy import SearchPolicy


@dataclass(frozen=True)
class Step:
    """What the search saw before it accepted something, or stopped."""

    ranked: tuple[Hypothesis, ...]  # the best of every family and place
    cosine: np.ndarray  # (n, n) among the ranked
    observed: dict[str, float]  # per family, and "unknown"
    parts: dict[str, float]  # evidence of unknown heat per part


@dataclass(frozen=True)
class Search:
    """The whole search."""

    detector: Detector
    x0: np.ndarray  # (n,) settled without a cause
    x: np.ndarray  # (n,) and with the accepted ones
    accepted: tuple[Accepted, ...]
    steps: tuple[Step, ...]  # one more than were accepted, the dropped ones among them
    fitted: Fitted  # the last fit, accepted amplitudes left in its residual
    entering: tuple[Entering, ...]  # heat that is left, the strongest first
    covariance: np.ndarray  # (n, n) of x
    loose: tuple[Loose, ...] = ()  # declared numbers out of their tolerance, the farthest first

    @property
    def residual(self) -> np.ndarray:
        """(m,) linearised, accepted amplitudes left in."""
        return self.fitted.residual

    @cached_property
    def unexplained(self) -> np.ndarray:
        """(m,) the white residual less what everything explains."""
        return unexplained(self.detector, self.fitted)

    @property
    def left(self) -> np.ndarray:
        """(m,) what each number has in the last fit's sum of squares, in units of all discrepancy."""
        return self.detector.whiten(self.residual) * self.unexplained

    @property
    def poor(self) -> bool:
        """Whether the model is wrong in its form: what is left has many times the variance that it should have."""
        return self.detector.poor or self.dispersion() > self.detector.policy.dispersed

    def dispersion(self, among: np.ndarray | None = None) -> float:
        """Of what is left, per measured number; among (m,) bool: of these alone, 0 where none of them is measured."""
        good = np.isfinite(self.residual)
        good = good if among is None else good & among
        return float(self.left[good].sum()) / max(int(good.sum()), 1)


Scored = tuple[Sight, list[Hypothesis]]  # all hypotheses that a detector has, at one fit


def scored(detector: Detector, fitted: Fitted) -> Scored:
    """Their scores: what costs most of a look."""
    white = detector.whiten(fitted.residual)
    seen = sight(detector.columns, fitted.projector, white)
    lost = lost_candidates(detector.lost, detector.columns.batches, fitted.projector, white)
    sized = sized_candidates(detector, fitted.projector, white)
    return seen, [*best(seen.ready, seen.g), *lost, *sized]


def look(
    detector: Detector, fitted: Fitted, more: Sequence[Hypothesis] = (), known: Scored | None = None
) -> tuple[Sight, list[Hypothesis], Step]:
    """All hypotheses there and some more, the best of every family and place first. known: the scores at this fit."""
    seen, hypotheses = scored(detector, fitted) if known is None else known
    ranked = distinct(sorted([*hypotheses, *more], key=lambda h: -h.statistic))
    top = ranked[:10]
    return seen, ranked, Step(tuple(top), cosines(detector, fitted, top), seen.largest(), evidence(seen.heat, seen.g))


def other_drives(seen: Sight, h: Hypothesis, policy: SearchPolicy) -> list[Hypothesis]:
    """A hypothesis that follows a signal with every other signal, at its best, where that scores nearly as much."""
    if not h.when.signal:
        return []
    own = next(own for own in seen.ready if own.batch is h.batch)
    scores = score(own, seen.g)
    statistic, amplitude = scores.statistic[h.place], scores.amplitude[h.place]
    best = dict[str, Hypothesis]()
    for i in np.argsort(-statistic):
        when = h.batch.histories[i]
        if statistic[i] > (1.0 - policy.behind) * h.statistic and when.signal not in ("", h.when.signal):
            other = Hypothesis(h.batch, h.place, when, float(statistic[i]), tuple(map(float, amplitude[i])))
            best.setdefault(when.signal, other)
    return list(best.values())


def with_cosines(
    detector: Detector, fitted: Fitted, chosen: Hypothesis, others: Sequence[Hypothesis]
) -> tuple[tuple[Hypothesis, float], ...]:
    """Others, with the cosine of each to the chosen one."""
    cosine = cosines(detector, fitted, [chosen, *others])
    return tuple((h, float(cosine[0, i])) for i, h in enumerate(others, start=1))


def distinct(ranked: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The first of every family, place and kind."""
    first = dict[tuple[str, str, str], Hypothesis]()
    for h in ranked:
        first.setdefault((h.family, h.name, h.batch.kind), h)
    return list(first.values())


def cosines(detector: Detector, fitted: Fitted, hypotheses: Sequence[Hypothesis]) -> np.ndarray:
    """(n, n) of the white responses at the fitted amplitudes."""
    if not hypotheses:
        return np.zeros((0, 0))
    D = np.stack([readings_columns(detector, h) @ np.array(h.amplitude) for h in hypotheses], axis=1)
    gram = D.T @ fitted.projector(D)
    size = np.sqrt(np.maximum(np.diag(gram), 1e-30))
    return np.asarray(np.clip(gram / np.outer(size, size), -1.0, 1.0))


def sized_candidates(detector: Detector, projector: Projector, white: np.ndarray) -> list[Hypothesis]:
    """Plays, clocks and lags that would explain white residuals (m,), at sizes that the bank of columns does not know:
    their responses change in shape with their size, not in height."""
    tried = [
        Hypothesis(batch, i, batch.histories[0], 0.0, (size,))
        for batch in detector.columns.batches
        for i in range(len(batch.places))
        for size in fault_of(batch).sizes
    ]
    if not tried:
        return []
    nominal = motion(detector, None)
    D = detector.whiten(np.column_stack([curved_change(detector, h, h.amplitude[0], nominal) for h in tried]))
    # all at once: N is large, and would be read twice for each of them
    B = projector.seen(np.column_stack([D, white]))
    half = scipy.linalg.solve_triangular(projector.factor[0], B, lower=True)
    explained = white @ D - half[:, -1] @ half[:, :-1]  # D^T Pi r
    own = (D**2).sum(axis=0) - (half[:, :-1] ** 2).sum(axis=0)  # D^T Pi D
    return [
        replace(h, statistic=float(2.0 * g - F)) for h, g, F in zip(tried, explained, own, strict=True) if 2.0 * g > F
    ]
