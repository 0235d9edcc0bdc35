"""All hypotheses at one fit, and what a whole search has seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.diagnose.evidence.batch import Hypothesis, best
from twin.diagnose.evidence.fitter import Fitted
from twin.diagnose.evidence.pulls import Loose
from twin.diagnose.evidence.sight import Sight, sight
from twin.diagnose.evidence.unknown import Heat, evidence
from twin.diagnose.faults.lost import lost_candidates
from twin.diagnose.search.accepted import Accepted, readings_columns
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.sizes import sized_candidates


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
    residual: np.ndarray  # (m,) linearised, of the last fit, accepted amplitudes left in
    g: np.ndarray  # (n_columns,) after the accepted ones
    heat: Heat  # likewise
    covariance: np.ndarray  # (n, n) of x
    left: np.ndarray  # (m,) of the last fit: what each number has in the sum of squares, in units of all discrepancy
    loose: tuple[Loose, ...] = ()  # declared numbers out of their tolerance, the farthest first

    @property
    def poor(self) -> bool:
        """Whether the model is wrong in its form: what is left has many times the variance that it should have."""
        return self.detector.poor or self.dispersion() > self.detector.policy.dispersed

    def dispersion(self, among: np.ndarray | None = None) -> float:
        """Of what is left, per measured number; among (m,) bool: of these alone, 0 where none of them is measured."""
        good = np.isfinite(self.residual)
        good = good if among is None else good & among
        return float(self.left[good].sum()) / max(int(good.sum()), 1)


@dataclass(frozen=True)
class Scored:
    """All hypotheses that a detector has, at one fit."""

    seen: Sight
    hypotheses: tuple[Hypothesis, ...]


def scored(detector: Detector, fitted: Fitted) -> Scored:
    """Their scores: what costs most of a look."""
    white = detector.whiten(fitted.residual)
    seen = sight(detector.columns, fitted.projector, white)
    lost = lost_candidates(detector.lost, detector.columns.batches, fitted.projector, white)
    sized = sized_candidates(detector, fitted.projector, white)
    return Scored(seen, (*best(seen.ready, seen.g), *lost, *sized))


def look(
    detector: Detector, fitted: Fitted, more: Sequence[Hypothesis] = (), known: Scored | None = None
) -> tuple[Sight, list[Hypothesis], Step]:
    """All hypotheses there and some more, the best of every family and place first. known: the scores at this fit."""
    known = scored(detector, fitted) if known is None else known
    seen = known.seen
    ranked = _distinct(sorted([*known.hypotheses, *more], key=lambda h: -h.statistic))
    top = ranked[:10]
    return seen, ranked, Step(tuple(top), cosines(detector, fitted, top), seen.largest(), evidence(seen.heat, seen.g))


def _distinct(ranked: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The best of every family, place and kind."""
    seen: set[tuple[str, str, str]] = set()
    result = []
    for h in ranked:
        key = (h.family, h.name, h.batch.kind)
        if key not in seen:
            seen.add(key)
            result.append(h)
    return result


def _direction(detector: Detector, h: Hypothesis) -> np.ndarray:
    """(m,) white response at the fitted amplitudes."""
    return np.asarray(readings_columns(detector, h) @ np.array(h.amplitude))


def cosines(detector: Detector, fitted: Fitted, hypotheses: Sequence[Hypothesis]) -> np.ndarray:
    if not hypotheses:
        return np.zeros((0, 0))
    D = np.stack([_direction(detector, h) for h in hypotheses], axis=1)
    gram = D.T @ fitted.projector(D)
    size = np.sqrt(np.maximum(np.diag(gram), 1e-30))
    return np.asarray(np.clip(gram / np.outer(size, size), -1.0, 1.0))
