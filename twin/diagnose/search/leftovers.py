"""Thresholds of a model that fits badly: what it leaves of these very runs is its discrepancy, and nobody can model it.

Synthetic measurements know a discrepancy of a good model. Of a poor one the leftovers of its best fit are the better
null (surrogate data: Theiler et al., Physica D 58, 1992): they are added to what the model computes for the same runs,
of random sign, moved in time and from one run to another, so that they keep their size, their memory and how channels
go together, and lose what a cause would have made of them: the same response to the same loads in every run. What the
families score there is the null distribution of this model, and detection limits grow with it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.diagnose.evidence.pulls import Pulls
from twin.diagnose.evidence.settled import settled_alone
from twin.diagnose.evidence.sight import sight
from twin.diagnose.search.detector import Detector, thresholds_of
from twin.diagnose.search.look import Search
from twin.progress import Progress, silent

SURROGATES = 60
SEED = 20_000


def with_leftovers(described: Detector, found: Search, y: np.ndarray, progress: Progress = silent) -> Detector:
    """The detector with thresholds and spreads of calibration that such leftovers reach, too; never lower ones.

    described: before anything was searched. y (m,): what was measured in the fitted runs.
    """
    study, fitter = described.study, described.fitter
    exact = [study.outputs(k, found.x0) for k in study.fitted]
    parts = _parts(described, y - np.concatenate(exact))
    left = [study.runs[k].split(part) for k, part in zip(study.fitted, parts, strict=True)]
    rng = np.random.default_rng(SEED)
    names, seen, fitted, settled = list(described.nulls), [], [], []
    with progress("measurements with leftovers: thresholds", SURROGATES) as advance:
        for _ in range(SURROGATES):
            other = np.concatenate([a + b for a, b in zip(exact, _surrogate(left, rng), strict=True)])
            at = fitter(np.where(np.isfinite(y), other, np.nan))
            seen.append(sight(described.columns, at.projector, described.whiten(at.residual)).largest())
            fitted.append(at.x)
            settled.append(settled_alone(fitter, np.where(np.isfinite(y), other, np.nan))[0])
            advance("")
    nulls = {name: np.array([s.get(name, 0.0) for s in seen]) for name in names}
    own, parameters = thresholds_of(nulls), study.probed.parameters
    pulls = Pulls.of(parameters, np.array(fitted), np.array(settled))
    thresholds = {name: max(value, own.get(name, 0.0)) for name, value in described.thresholds.items()}
    return replace(described, nulls=nulls, thresholds=thresholds, pulls=_wider(described.pulls, pulls))


def _wider(a: Pulls, b: Pulls) -> Pulls:
    """The spread of each parameter that is the larger one, and the larger limit."""
    pairs = [(a.fitted, b.fitted), (a.settled, b.settled)]
    fitted, settled = (replace(p, sigma=np.maximum(p.sigma, q.sigma), limit=max(p.limit, q.limit)) for p, q in pairs)
    return Pulls(fitted, settled)


def _parts(detector: Detector, values: np.ndarray) -> list[np.ndarray]:
    sizes = [detector.study.runs[k].size for k in detector.study.fitted]
    return np.split(values, np.cumsum(sizes)[:-1])


def _surrogate(left: list[tuple[np.ndarray, np.ndarray]], rng: np.random.Generator) -> list[np.ndarray]:
    """Per run (size,): the leftovers of a run, its own or another one's, in its channels and rows.

    All channels of a run share sign, shift and origin: how they go together is what form is.
    """
    made = []
    for T, w in left:
        donors = [d for d in left if d[0].shape[1] == T.shape[1]]
        donor = donors[int(rng.integers(len(donors)))]
        sign, shift = rng.choice([-1.0, 1.0]), rng.random()
        moved = [_moved(d, rows, shift).ravel() for d, rows in zip(donor, (len(T), len(w)), strict=True)]
        made.append(sign * np.concatenate(moved))
    return made


def _moved(values: np.ndarray, rows: int, shift: float) -> np.ndarray:
    """(rows, c): values (n, c) of another run brought to so many rows, from a share of the run on, forwards to its end
    and then backwards, so that nothing leaps; gaps are bridged."""
    n = len(values)
    if not n or not rows:
        return np.zeros((rows, values.shape[1]))
    at = (np.arange(rows) * (n / rows) + shift * 2 * n).astype(int) % (2 * n)
    filled = np.column_stack([_bridged(column) for column in values.T]) if values.shape[1] else values
    return filled[np.where(at < n, at, 2 * n - 1 - at)]


def _bridged(values: np.ndarray) -> np.ndarray:
    good = np.isfinite(values)
    return np.interp(np.arange(len(values)), np.flatnonzero(good), values[good]) if good.any() else np.zeros(len(values))
