"""Single axis errors from measured TCP displacements by least squares, with a rank that says what cannot be known.

d = A e + N v + noise: e the axis errors, v shift and tilt and, where the balls' places are unknown, their offsets. N is
projected out of A, and what is left, with errors counted as displacements at the end of the ranges, goes through a
singular-value decomposition. Directions whose singular value is below `TOLERANCE` of a full column's are hidden: any
amount of them leaves the readings as they are. An error is *determined* where no hidden direction contains it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from twin.calibrate.axis_errors.chain import Chain
from twin.calibrate.axis_errors.errors import Ranges, axis_errors, design_matrix, effect_size, rigid_motion
from twin.errors import LogError

TOLERANCE = 1e-3  # singular values, of a column that is felt in full by every row: 0.1 mm of scatter in 100 mm
_PART = 1e-2  # an error belongs to a hidden direction where it is more than this part of it
_ZERO = 1e-9  # singular values of shift, tilt and offsets: these may be collinear, and are not asked for one by one
_DOUBT = 1e-3  # chance of a misfit alarm where there is none


@dataclass(frozen=True)
class Combination:
    """A weighted sum of errors, each counted as its displacement at the end of the ranges."""

    weights: dict[str, float]  # by name; the largest is 1
    value: float = np.nan  # m
    sigma: float = np.nan  # m

    def __str__(self) -> str:
        terms = [("-" if w < 0.0 else "+", "" if abs(abs(w) - 1.0) < 5e-3 else f"{abs(w):.2f} ", name)
                 for name, w in self.weights.items()]  # fmt: skip
        return " ".join(f"{sign} {size}{name}" for sign, size, name in terms).removeprefix("+ ")


@dataclass(frozen=True)
class AxisErrorFit:
    """Errors of one measurement; arrays in the order of `names`."""

    names: tuple[str, ...]
    units: tuple[str, ...]  # "m" or "rad"
    value: np.ndarray  # (n,) at the end of the ranges; NaN where not determined
    sigma: np.ndarray  # (n,) standard deviation; NaN where not determined
    determined: np.ndarray  # (n,) bool
    rank: int  # directions of the errors that the readings show
    hidden: tuple[Combination, ...]  # n - rank of them: any amount of each changes nothing
    visible: tuple[Combination, ...]  # of the undetermined errors, what is determined all the same
    shift: np.ndarray  # (3,) m, TCP displacement in the middle of the ranges, hidden directions taken as zero
    shift_sigma: np.ndarray  # (3,) m
    tilt: np.ndarray  # (3,) rad, of all axes against the workpiece, likewise; NaN where not determined
    tilt_sigma: np.ndarray  # (3,) rad
    residual: np.ndarray  # (rows, 3) m
    noise: float  # m: standard deviation of the readings, as stated, else as the residuals have it
    misfit: bool  # the residuals are larger than the stated noise explains; sigmas are then widened accordingly
    singular: np.ndarray  # (n,) of the scaled design matrix, 1 for a column felt in full

    @property
    def rms(self) -> float:
        """m, of the residuals."""
        return float(np.sqrt(np.mean(self.residual**2)))

    def values(self) -> dict[str, float]:
        """The determined errors by name."""
        return {n: float(v) for n, v, known in zip(self.names, self.value, self.determined, strict=True) if known}


def rows_needed(chain: Chain, balls: int = 0) -> int:
    """Rows of three components that a fit takes at least: one more than the unknowns ask for."""
    return -(-(len(axis_errors(chain)) + 6 + 3 * balls) // 3) + 1


def fit_axis_errors(
    chain: Chain,
    ranges: Ranges,
    position: np.ndarray,
    displacement: np.ndarray,
    sigma: np.ndarray | None = None,
    balls: Sequence[np.ndarray] = (),
) -> AxisErrorFit:
    """Fit all errors of the chain's linear axes to displacements (n, 3) [m] at positions (n, n_linear) [m].

    sigma (n,) [m]: of each component of each row. balls: per ball of unknown place (n, 3, 3), the displacement per
    offset of that ball, zero in rows of the others (`twin.calibrate.axis_errors.rtest.ball_columns`).
    Raises LogError where there are fewer rows than `rows_needed`.
    """
    if len(position) < (needed := rows_needed(chain, len(balls))):
        what = f"{len(position)} rows, where {needed} are needed for {len(axis_errors(chain))} axis errors"
        raise LogError(what, "tcp.csv", "measure at more poses")
    errors = axis_errors(chain)
    size = effect_size(chain, ranges)
    weight = np.repeat(1.0 / (np.full(len(position), 1.0) if sigma is None else sigma), 3)
    weight_mean = float(np.sqrt(np.mean(weight**2)))
    A = _rows(design_matrix(chain, ranges, position)) / size * weight[:, None]
    N = np.hstack([_rows(block) for block in (rigid_motion(chain, ranges, position), *balls)]) * weight[:, None]
    d = displacement.ravel() * weight
    Q = _range_of(N)
    U, s, Vt = np.linalg.svd(A - Q @ (Q.T @ A), full_matrices=True)
    scaled = s / (weight_mean * np.sqrt(len(position)))
    rank = int((scaled > TOLERANCE).sum())
    V, null = Vt[:rank].T, Vt[rank:]
    inverse = V @ (U[:, :rank] / s[:rank]).T  # effects at the end of the ranges per weighted reading
    effect = inverse @ d
    length = np.maximum(np.linalg.norm(N, axis=0), np.finfo(float).tiny)
    others = np.linalg.pinv(N / length, rcond=_ZERO) / length[:, None]
    residual = d - A @ effect
    rest = others @ residual
    residual = residual - N @ rest
    freedom = max(len(d) - rank - Q.shape[1], 1)
    spread = float(np.sqrt(residual @ residual / freedom))
    misfit = sigma is not None and bool(residual @ residual > chdtri(freedom, _DOUBT))
    scale = spread if sigma is None or misfit else 1.0
    covariance = scale**2 * inverse @ inverse.T
    rest_sigma = scale * np.linalg.norm(others - others @ A @ inverse, axis=1)
    rigid_known = np.abs((others @ N - np.eye(N.shape[1]))[:6]).max(axis=1) < _PART
    rest, rest_sigma = (np.where(rigid_known, values[:6], np.nan) for values in (rest, rest_sigma))
    hidden_part = np.abs(null).max(axis=0, initial=0.0)
    determined = hidden_part < _PART
    names = tuple(e.name for e in errors)
    return AxisErrorFit(
        names=names,
        units=tuple(e.unit for e in errors),
        value=np.where(determined, effect / size, np.nan),
        sigma=np.where(determined, np.sqrt(np.diag(covariance)) / size, np.nan),
        determined=determined,
        rank=rank,
        hidden=tuple(_combination(row, names) for row in _sparse(null, ~determined)),
        visible=tuple(
            _combination(row, names, float(row @ effect), float(np.sqrt(row @ covariance @ row)))
            for row in _sparse(_complement(null, ~determined), ~determined)
        ),
        shift=rest[:3],
        shift_sigma=rest_sigma[:3],
        tilt=rest[3:],
        tilt_sigma=rest_sigma[3:],
        residual=(residual / weight).reshape(-1, 3),
        noise=spread if sigma is None else 1.0 / weight_mean,
        misfit=misfit,
        singular=scaled,
    )


def _rows(block: np.ndarray) -> np.ndarray:
    """(n, 3, m) -> (3 n, m)."""
    return block.reshape(-1, block.shape[2])


def _range_of(matrix: np.ndarray) -> np.ndarray:
    """Orthonormal columns that span those of a matrix."""
    length = np.linalg.norm(matrix, axis=0)
    Q, s, _ = np.linalg.svd(matrix / np.where(length > 0.0, length, 1.0), full_matrices=False)
    return np.asarray(Q[:, s > _ZERO * s[0]])


def _complement(null: np.ndarray, members: np.ndarray) -> np.ndarray:
    """Rows that span what is orthogonal to the hidden directions among the undetermined errors."""
    if not members.any():
        return np.zeros((0, len(members)))
    _, _, Vt = np.linalg.svd(null[:, members])
    rows = np.zeros((members.sum() - len(null), len(members)))
    rows[:, members] = Vt[len(null) :]
    return rows


def _sparse(rows: np.ndarray, members: np.ndarray) -> np.ndarray:
    """The same span by rows with as few errors as row reduction gives, the largest weight of each 1."""
    reduced = np.where(members, rows, 0.0)
    done = 0
    for column in np.flatnonzero(members)[::-1]:  # the names that come first are spoken of last
        if done == len(reduced):
            break
        pivot = done + int(np.argmax(np.abs(reduced[done:, column])))
        if abs(reduced[pivot, column]) < _PART:
            continue
        reduced[[done, pivot]] = reduced[[pivot, done]]
        reduced[done] /= reduced[done, column]
        for k in range(len(reduced)):
            if k != done:
                reduced[k] -= reduced[k, column] * reduced[done]
        done += 1
    reduced = reduced[:done]
    reduced[np.abs(reduced) < _PART] = 0.0
    first = np.argmax(reduced != 0.0, axis=1)
    return (reduced / np.abs(reduced).max(axis=1, keepdims=True, initial=1e-300))[np.argsort(first, kind="stable")]


def _combination(row: np.ndarray, names: tuple[str, ...], value: float = np.nan, sigma: float = np.nan) -> Combination:
    weights = {n: float(w) for n, w in zip(names, row, strict=True) if w}
    first = next(iter(weights.values()), 1.0)
    sign = -1.0 if first < 0.0 else 1.0
    return Combination({n: sign * w for n, w in weights.items()}, sign * value, sigma)
