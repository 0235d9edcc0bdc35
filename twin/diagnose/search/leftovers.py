"""Thresholds of a model that fits badly: what it leaves of these very runs is its discrepancy, and nobody can model it.

Synthetic measurements know the discrepancy of a good model. Of a poor one, what neither calibration nor the known
discrepancy nor the causes that were found explain is the better null (surrogate data: Theiler et al., Physica D 58,
1992). In units of what a good model would leave, it is put to other channels and with other signs, the same in all
runs: so it keeps its size, its memory, and that form is the same in every run, as a cause is; it loses its place. What
the families score there, and in what is left as it stands, no cause is known to score: a cause must do better than what
remains beside it. Detection limits grow with that.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.evidence.fitter import Fitted
from twin.diagnose.evidence.pulls import Pulls
from twin.diagnose.evidence.sight import sight
from twin.diagnose.search.accepted import exchanged
from twin.diagnose.search.detector import Detector, thresholds_of
from twin.diagnose.search.gain import predicted
from twin.diagnose.search.look import Search
from twin.progress import Progress, silent

SURROGATES = 100
SEED = 20_000


@dataclass(frozen=True)
class Leftovers:
    """What the best fit leaves, white: of unit variance where the model is as good as its detector takes it to be."""

    fitted: Fitted  # of the measurements less what the causes that were found add
    white: np.ndarray  # (m,) nuisance projected out

    def by_sensor(self, detector: Detector) -> np.ndarray:
        """(s,) rms of each sensor over all fitted runs."""
        square = np.concatenate([T for T, _ in _by_run(detector, self.white)]) ** 2
        used = square > 0.0  # what was not measured is zero
        return np.asarray(np.sqrt(square.sum(axis=0) / np.maximum(used.sum(axis=0), 1)))


def leftovers(detector: Detector, found: Search, y: np.ndarray) -> Leftovers:
    """Of measurements y (m,) of the fitted runs."""
    study = detector.study
    added = [predicted(found, k).extended - study.outputs(k, found.x) for k in study.fitted if found.accepted]
    rest = exchanged(study, y, found.accepted) - (np.concatenate(added) if added else 0.0)
    fitted = detector.fitter(rest)
    return Leftovers(fitted, fitted.projector(detector.whiten(fitted.residual)))


def with_leftovers(described: Detector, left: Leftovers, progress: Progress = silent) -> Detector:
    """The detector with thresholds that such leftovers reach, too; never lower ones.

    No declared number is out of its tolerance any more: what moved it may be form. described: before any search.
    """
    runs, rng, seen = _by_run(described, left.white), np.random.default_rng(SEED), []
    with progress("what is left as noise: thresholds", SURROGATES) as advance:
        for _ in range(SURROGATES):
            seen.append(sight(described.columns, left.fitted.projector, surrogate(runs, rng)).largest())
            advance("")
    nulls = {name: np.array([s.get(name, 0.0) for s in seen]) for name in described.nulls}
    own, remains = thresholds_of(nulls), sight(described.columns, left.fitted.projector, left.white).largest()
    thresholds = {n: max(value, own.get(n, 0.0), remains.get(n, 0.0)) for n, value in described.thresholds.items()}
    pulls = Pulls(*(replace(p, limit=np.inf) for p in (described.pulls.fitted, described.pulls.settled)))
    return replace(described, nulls=nulls, thresholds=thresholds, pulls=pulls)


def surrogate(runs: list[tuple[np.ndarray, np.ndarray]], rng: np.random.Generator) -> np.ndarray:
    """(m,) white: what was left of sensors (b, s) of each run in others' places, of them and the TCP (k, 3) with other
    signs; the same in all runs that have as many sensors."""
    width = max(T.shape[1] for T, _ in runs)
    order, signs, of_tcp = rng.permutation(width), rng.choice([-1.0, 1.0], width), rng.choice([-1.0, 1.0], 3)
    made = []
    for T, w in runs:
        own = order[order < T.shape[1]]
        made.append(np.concatenate([(T[:, own] * signs[: len(own)]).ravel(), (w * of_tcp).ravel()]))
    return np.concatenate(made)


def _by_run(detector: Detector, white: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    study = detector.study
    ends = np.cumsum([study.runs[k].size for k in study.fitted])[:-1]
    return [study.runs[k].split(part) for k, part in zip(study.fitted, np.split(white, ends), strict=True)]
