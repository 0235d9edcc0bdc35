"""Heat of any history: a Gaussian process per part, for what no entry of the catalogue explains.

Heat in blocks of an hour at every surface of a part, with a squared-exponential covariance in time of 2 h, independent
from surface to surface. The statistic is twice the log evidence against no heat

    max over sigma of  g^T (K^-1 + F)^-1 g - ln det(1 + K F),      K = sigma^2 R

with g = D^T Pi r, F = D^T Pi D (Rasmussen, Williams 2006, eq 2.30), which charges for its freedom.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from twin.diagnose.model.study import Study
from twin.diagnose.result.spot import Spot

MEMORY = 2.0  # blocks
SIGMAS = (3.0, 12.0, 50.0)  # W


@dataclass(frozen=True)
class Heat:
    """Per part its columns and matrices."""

    parts: tuple[str, ...]
    surfaces: tuple[tuple[str, ...], ...]
    columns: tuple[np.ndarray, ...]  # (L,) surface by surface, blocks of each
    F: tuple[np.ndarray, ...]  # (L, L)
    roots: tuple[tuple[np.ndarray, ...], ...]  # per sigma (L, L): its square is the covariance after the data
    charges: tuple[tuple[float, ...], ...]  # per sigma ln det(1 + K F)
    R: np.ndarray  # (n_blocks, n_blocks) correlation in time


def heat_of(study: Study, blocks: Sequence[tuple[int, int, int]], of_place: Mapping[str, np.ndarray]) -> Heat:
    """The unknown channel of a study, without matrices yet; of_place: columns of 1 W in every block (fitted
    run, first step, end)."""
    parts = list(dict.fromkeys(m for p in study.probed.places for m in p.members))
    length = float(np.median([b - a for _, a, b in blocks]))
    faces = [p for p in study.probed.places if not Spot.read(p.name).pad]
    surfaces = tuple(tuple(p.name for p in faces if part in p.members) for part in parts)
    columns = tuple(np.concatenate([np.zeros(0, int), *(of_place[name] for name in own)]) for own in surfaces)
    return Heat(tuple(parts), surfaces, columns, (), (), (), correlation(blocks, MEMORY * length))


def correlation(blocks: Sequence[tuple[int, int, int]], memory: float) -> np.ndarray:
    """(n_blocks, n_blocks) of blocks (fitted run, first step, end), squared-exponential over a memory in steps; blocks
    of different runs have none."""
    run = np.array([i for i, _, _ in blocks])
    when = np.array([(a + b) / 2 for _, a, b in blocks], dtype=float)
    R = np.exp(-0.5 * ((when[:, None] - when) / memory) ** 2) * (run[:, None] == run)
    return np.asarray(R + 1e-6 * np.eye(len(blocks)))


def with_information(heat: Heat, F: Sequence[np.ndarray]) -> Heat:
    """The same with other matrices D^T Pi D: after causes that were accepted."""
    L1 = np.linalg.cholesky(heat.R)
    roots, charges = [], []
    for own, names in zip(F, heat.surfaces, strict=True):
        of_sigma, of_charge = [], []
        L = np.kron(np.eye(len(names)), L1)
        for sigma in SIGMAS:
            inner = np.eye(len(L)) + sigma**2 * (L.T @ own @ L)
            factor = np.linalg.cholesky((inner + inner.T) / 2)
            of_sigma.append(scipy.linalg.solve_triangular(factor, sigma * L.T, lower=True))
            of_charge.append(2.0 * float(np.log(np.diag(factor)).sum()))
        roots.append(tuple(of_sigma))
        charges.append(tuple(of_charge))
    return replace(heat, F=tuple(F), roots=tuple(roots), charges=tuple(charges))


def evidence(heat: Heat, g: np.ndarray) -> dict[str, float]:
    """Twice the log evidence of unknown heat in every part."""
    return {
        part: max(_evidence(heat, k, s, g) for s in range(len(SIGMAS)))
        for k, part in enumerate(heat.parts)
        if len(heat.columns[k])
    }


def _evidence(heat: Heat, k: int, s: int, g: np.ndarray) -> float:
    half = heat.roots[k][s] @ g[heat.columns[k]]
    return float(half @ half - heat.charges[k][s])


def surfaces_of(heat: Heat, g: np.ndarray, part: str, share: float) -> list[str]:
    """The surface of a part where heat has the most evidence alone, and those with a share of that, in their order. The
    one that takes most of a part's heat may be another one: of two that are felt alike much may enter one and leave by
    the other."""
    k = heat.parts.index(part)
    n, L = len(heat.R), np.linalg.cholesky(heat.R)
    found = dict[str, float]()
    for i, name in enumerate(heat.surfaces[k]):
        own = slice(i * n, (i + 1) * n)
        F, score = L.T @ heat.F[k][own, own] @ L, L.T @ g[heat.columns[k][own]]
        found[name] = max(_alone(sigma * score, np.eye(n) + sigma**2 * (F + F.T) / 2) for sigma in SIGMAS)
    ordered = sorted(found, key=lambda name: -found[name])
    return [name for name in ordered if found[name] >= share * found[ordered[0]]] or ordered[:1]


def _alone(score: np.ndarray, matrix: np.ndarray) -> float:
    factor = np.linalg.cholesky(matrix)
    half = scipy.linalg.solve_triangular(factor, score, lower=True)
    return float(half @ half) - 2.0 * float(np.log(np.diag(factor)).sum())
