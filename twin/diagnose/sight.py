"""All hypotheses as the data see them at one calibration: scores of every column and what they are judged with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.diagnose.batch import Batch, Prepared, prepared, score
from twin.diagnose.unknown import Heat, evidence, with_information
from twin.diagnose.whiten import Projector

CHUNK = 2000  # columns that are lifted to double precision at once


@dataclass(frozen=True)
class Columns:
    """White responses of all columns, and what of them no data can change."""

    raw: np.ndarray  # (m, n) float32
    batches: tuple[Batch, ...]
    grams: tuple[np.ndarray, ...]  # per batch (p, L, L): D^T D of each place
    heat: Heat  # with D^T D as its F

    @classmethod
    def of(cls, raw: np.ndarray, batches: Sequence[Batch], heat: Heat) -> Columns:
        """heat: with any F."""
        grams = tuple(np.stack([_gram(raw, c) for c in b.columns]) for b in batches)
        return cls(raw, tuple(batches), grams, with_information(heat, [_gram(raw, c) for c in heat.columns]))


def _gram(raw: np.ndarray, columns: np.ndarray) -> np.ndarray:
    D = raw[:, columns].astype(float)
    return np.asarray(D.T @ D)


@dataclass(frozen=True)
class Sight:
    """At one projector."""

    g: np.ndarray  # (n,) D^T Pi r
    blocks: tuple[np.ndarray, ...]  # per batch (p, L, L): D^T Pi D
    ready: tuple[Prepared, ...]
    heat: Heat

    def largest(self) -> dict[str, float]:
        """Per family, and "unknown", the largest statistic."""
        result: dict[str, float] = {}
        for own in self.ready:
            best = float(score(own, self.g).statistic.max())
            result[own.batch.family] = max(result.get(own.batch.family, 0.0), best)
        result["unknown"] = max(evidence(self.heat, self.g).values(), default=0.0)
        return result


def sight(columns: Columns, projector: Projector, white: np.ndarray) -> Sight:
    """The scores of white residuals (m,)."""
    raw = columns.raw
    n = raw.shape[1]
    N, lower = projector.N, np.tril(projector.factor[0])
    B = np.empty((N.shape[1], n))
    g = np.empty(n)
    for first in range(0, n, CHUNK):
        part = raw[:, first : first + CHUNK].astype(float)
        B[:, first : first + CHUNK] = N.T @ part
        g[first : first + CHUNK] = white @ part
    half = np.linalg.solve(lower, B)  # F = D^T D - half^T half
    g = g - half.T @ np.linalg.solve(lower, N.T @ white)
    blocks = []
    for batch, gram in zip(columns.batches, columns.grams, strict=True):
        own = half[:, batch.columns].transpose(1, 0, 2)  # (p, q, L)
        blocks.append(gram - own.transpose(0, 2, 1) @ own)
    heat = with_information(
        columns.heat, [F - half[:, c].T @ half[:, c] for F, c in zip(columns.heat.F, columns.heat.columns, strict=True)]
    )
    ready = tuple(prepared(b, own) for b, own in zip(columns.batches, blocks, strict=True))
    return Sight(g, tuple(blocks), ready, heat)
