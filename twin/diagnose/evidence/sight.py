"""All hypotheses as the data see them at one calibration: scores of every column and what they are judged with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from twin.diagnose.evidence.batch import Batch, Prepared, prepared, score
from twin.diagnose.evidence.unknown import Heat, evidence, with_information
from twin.diagnose.evidence.whiten import Projector

CHUNK = 2000  # columns that are lifted to double precision at once


@dataclass(frozen=True)
class Columns:
    """White responses of all columns, and what of them no data can change."""

    raw: np.ndarray  # (m, n) float32
    batches: tuple[Batch, ...]
    grams: tuple[np.ndarray, ...]  # per batch (p, L, L): D^T D of each place
    heat: Heat  # with D^T D as its F
    others: np.ndarray  # (q, n) of the nuisance columns that are the same for all data (`fitter`)

    @classmethod
    def of(cls, raw: np.ndarray, batches: Sequence[Batch], heat: Heat, others: np.ndarray) -> Columns:
        """heat: with any F; others (m, q) white."""
        grams = tuple(np.stack([_gram(raw, c) for c in b.columns]) for b in batches)
        with_F = with_information(heat, [_gram(raw, c) for c in heat.columns])
        return cls(raw, tuple(batches), grams, with_F, _product(others, raw))

    def beside(self, others: np.ndarray) -> Columns:
        """The same with other nuisance columns (m, q), white."""
        return replace(self, others=_product(others, self.raw))


def _product(left: np.ndarray, raw: np.ndarray) -> np.ndarray:
    """left^T raw in double precision, some columns at a time."""
    result = np.empty((left.shape[1], raw.shape[1]))
    for first in range(0, raw.shape[1], CHUNK):
        result[:, first : first + CHUNK] = left.T @ raw[:, first : first + CHUNK].astype(float)
    return result


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
    lower = np.tril(projector.factor[0])
    # the first ones belong to these data: parameters, accepted causes
    own = projector.N[:, : len(lower) - len(columns.others)]
    product = _product(np.column_stack([own, white]), columns.raw)
    B, g = np.vstack([product[:-1], columns.others]), product[-1]
    half = scipy.linalg.solve_triangular(lower, B, lower=True)  # F = D^T D - half^T half
    g = g - half.T @ scipy.linalg.solve_triangular(lower, projector.seen(white), lower=True)
    blocks = []
    for batch, gram in zip(columns.batches, columns.grams, strict=True):
        of_place = half[:, batch.columns].transpose(1, 0, 2)  # (p, q, L)
        blocks.append(gram - of_place.transpose(0, 2, 1) @ of_place)
    heat = with_information(
        columns.heat, [F - half[:, c].T @ half[:, c] for F, c in zip(columns.heat.F, columns.heat.columns, strict=True)]
    )
    ready = tuple(prepared(b, own) for b, own in zip(columns.batches, blocks, strict=True))
    return Sight(g, tuple(blocks), ready, heat)
