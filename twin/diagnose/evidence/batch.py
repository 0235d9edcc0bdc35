"""Hypotheses of one family, scored together: profile likelihood ratios after everything calibratable is projected out.

With g = D^T Pi r and F = D^T Pi D of a hypothesis's columns D (`twin.diagnose.evidence.whiten`)

    LR = g^T F^-1 g,   a = F^-1 g            amplitudes free (score test, exact in the linear model; Rao 1948)
    LR = 2 sum g - sum F                     amplitudes one: all of a source, an exact factor

Amplitudes of the wrong sign do not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.diagnose.evidence.bells import Bell
from twin.machine.effects.effect import Window

RIDGE = 1e-9


@dataclass(frozen=True)
class History:
    """When a hypothesis acts."""

    name: str  # "always", "spindle_speed^1.67", "from 4.0 h to 6.0 h of run_1"
    weights: np.ndarray  # (q, L) of the L columns of a place
    signal: str = ""
    exponent: float = 1.0
    reference: float = 1.0  # value of the signal [SI] at which the amplitude holds
    windows: tuple[Window, ...] = ()
    bell: Bell | None = None  # of the sun


@dataclass(frozen=True)
class Batch:
    """p places times h histories of a family; q amplitudes each."""

    family: str
    kind: str  # of the elementary causes, see `elements` and `readings`
    unit: str
    places: tuple[str, ...]
    columns: np.ndarray  # (p, L) indices among all columns
    histories: tuple[History, ...]
    sign: int = 0  # of the first amplitude; 0: either
    fixed: bool = False  # amplitudes are one
    smallest: float = 0.0  # first amplitude worth naming, in `unit`
    largest: tuple[float, ...] = ()  # per place, beyond which physics has no such cause; empty: none known
    positive: bool = False  # no amplitude is below nought

    @property
    def q(self) -> int:
        return self.histories[0].weights.shape[0]

    def possible(self, place: int, amplitude: float, uncertain: float = 0.0) -> bool:
        """Whether a first amplitude at a place, known but for so much, is of the sign and within the range that physics
        allows."""
        return (self.sign == 0 or self.sign * amplitude > 0.0) and (
            not self.largest or abs(amplitude) - uncertain <= self.largest[place]
        )


@dataclass(frozen=True)
class Scores:
    """Of a batch: (p, h)."""

    statistic: np.ndarray
    amplitude: np.ndarray  # (p, h, q)


@dataclass(frozen=True)
class Prepared:
    """A batch with what does not depend on the data."""

    batch: Batch
    W: np.ndarray  # (h, q, L)
    inverse: np.ndarray  # (p, h, q, q) of F
    total: np.ndarray  # (p, h) sum of F

    @property
    def information(self) -> np.ndarray:
        """(p, h) of the first amplitude: 1 / its variance."""
        return np.asarray(1.0 / np.maximum(self.inverse[..., 0, 0], 1e-30))


def prepared(batch: Batch, blocks: np.ndarray) -> Prepared:
    """blocks (p, L, L): D^T Pi D among the columns of each place."""
    W = np.stack([h.weights for h in batch.histories])
    F = np.einsum("phqm,hrm->phqr", np.einsum("hql,plm->phqm", W, blocks, optimize=True), W, optimize=True)
    trace = np.trace(F, axis1=2, axis2=3)[..., None, None]
    inverse = np.linalg.inv(F + (trace * RIDGE + 1e-12) * np.eye(batch.q))
    return Prepared(batch, W, inverse, F.sum(axis=(2, 3)))


def score(ready: Prepared, g: np.ndarray) -> Scores:
    """g (n,) of all columns."""
    batch = ready.batch
    num = np.einsum("hql,pl->phq", ready.W, g[batch.columns], optimize=True)
    a = np.einsum("phqr,phr->phq", ready.inverse, num)
    if batch.positive:
        a = _without_negatives(a, ready.inverse)
    if batch.fixed:
        return Scores(np.maximum(2.0 * num.sum(axis=2) - ready.total, 0.0), np.ones_like(a))
    statistic = np.einsum("phq,phq->ph", num, a)
    wrong = np.abs(a[..., 0]) < batch.smallest
    if batch.sign:
        wrong |= batch.sign * a[..., 0] < 0.0
    return Scores(np.where(wrong, 0.0, np.maximum(statistic, 0.0)), a)


def _without_negatives(a: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    """Most likely amplitudes (p, h, q), inverse (p, h, q, q), those below nought held there, the surest of them first;
    the first amplitude has a sign of its own."""
    for _ in range(a.shape[-1] - 1):
        sigma = np.sqrt(np.diagonal(inverse, axis1=-2, axis2=-1))
        k = np.argmin(a / np.maximum(sigma, 1e-150), axis=-1)[..., None]
        least, column = np.take_along_axis(a, k, -1), np.take_along_axis(inverse, k[..., None], -1)[..., 0]
        per = np.where(least < 0.0, column / np.maximum(np.take_along_axis(column, k, -1), 1e-300), 0.0)
        a, inverse = a - per * least, inverse - per[..., None] * column[..., None, :]
    return a


@dataclass(frozen=True)
class Hypothesis:
    """One of a batch."""

    batch: Batch
    place: int
    when: History
    statistic: float
    amplitude: tuple[float, ...]

    @property
    def family(self) -> str:
        return self.batch.family

    @property
    def name(self) -> str:
        return self.batch.places[self.place]

    def combination(self) -> tuple[np.ndarray, np.ndarray]:
        """Indices (L,) of the columns and weights (q, L)."""
        return self.batch.columns[self.place], self.when.weights


def best(ready: Sequence[Prepared], g: np.ndarray, count: int = 12) -> list[Hypothesis]:
    """The best hypotheses of all batches, one per batch and place, largest statistic first."""
    found: list[Hypothesis] = []
    for own in ready:
        scores = score(own, g)
        top = np.argmax(scores.statistic, axis=1)
        for p in np.argsort(-scores.statistic.max(axis=1))[:count]:
            h = int(top[p])
            amplitude = tuple(map(float, scores.amplitude[p, h]))
            statistic = float(scores.statistic[p, h])
            found.append(Hypothesis(own.batch, int(p), own.batch.histories[h], statistic, amplitude))
    return sorted(found, key=lambda f: -f.statistic)
