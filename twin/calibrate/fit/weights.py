"""Weights of a channel's hours: one bad hour shall not decide a fit, nor be thrown away unseen.

Residuals of a stretch of about an hour, whitened, are taken as a multivariate Student t: one unknown scale per stretch,
its spread given by the degrees of freedom. These and the scale of the channel are those of the highest likelihood over
all its stretches in all runs; where a normal distribution is as likely, nothing is weighted. The weight of a stretch of
m rows with mean square q is (nu + m)/(nu + m q/s²): Lange, Little, Taylor, J. Am. Statist. Assoc. 84, 1989, eq (3).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import gammaln

STRETCH = 3600.0  # s
FREEDOMS = (1.0, 2.0, 4.0, 8.0, 16.0)  # degrees of freedom that are tried, beside a normal distribution
# nats that a Student t must gain over a normal distribution: e^10 to 1, so that noise without bad hours, which may gain
# one or two by chance, keeps plain least squares
GAIN = 10.0
FEWEST = 6  # stretches of a channel, for a distribution of their scales
_STEPS = 30  # of the iteration for the scale; it gains a digit in three


def stretch_weights(white: Sequence[np.ndarray], time: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Weights (n,) of the rows of one channel in each run; ones where plain least squares is right.

    white: whitened residuals (n,) of each run, zero where nothing was measured; time: (n,) s. Relative to a channel
    whose scale is that of its good stretches, so weights may exceed one where bad ones had made it look noisy.
    """
    if not white:
        return []
    index = [np.floor(t / STRETCH).astype(int) for t in time]
    used = [w != 0.0 for w in white]
    rows = np.concatenate(
        [np.bincount(i[u], minlength=int(i.max(initial=0)) + 1) for i, u in zip(index, used, strict=True)]
    )
    squares = np.concatenate(
        [np.bincount(i, w**2, minlength=int(i.max(initial=0)) + 1) for i, w in zip(index, white, strict=True)]
    )
    some = rows > 0
    weight = np.ones(len(rows))
    if some.sum() >= FEWEST:
        weight[some] = _weights(rows[some].astype(float), squares[some])
    parts = np.split(weight, np.cumsum([int(i.max(initial=0)) + 1 for i in index])[:-1])
    return [part[i] for part, i in zip(parts, index, strict=True)]


def _weights(m: np.ndarray, square: np.ndarray) -> np.ndarray:
    """Of stretches of m rows (k,) with sums of squares (k,)."""
    total = float(m.sum())
    s2 = max(float(square.sum()) / total, 1e-300)
    best, weight = -0.5 * total * (np.log(2.0 * np.pi * s2) + 1.0) + GAIN, np.ones(len(m))
    for nu in FREEDOMS:
        s2 = max(float(np.median(square / m)), 1e-300)
        for _ in range(_STEPS):
            w = (nu + m) / (nu + square / s2)
            s2 = max(float(w @ square) / total, 1e-300)
        likelihood = float(
            np.sum(
                gammaln((nu + m) / 2.0) - gammaln(nu / 2.0) - 0.5 * m * np.log(nu * np.pi * s2)
                - 0.5 * (nu + m) * np.log1p(square / (nu * s2))
            )
        )  # fmt: skip
        if likelihood > best:
            best, weight = likelihood, (nu + m) / (nu + square / s2) / s2
    return weight
