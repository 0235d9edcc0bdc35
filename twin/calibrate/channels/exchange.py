"""Two temperature channels that have each other's names: the pair whose exchange makes both as all others say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.calibrate.channels.prediction import Prediction, predictors
from twin.calibrate.channels.readings import Readings
from twin.calibrate.channels.shapes import BEFORE, History

# Of the statistic of an exchange, for a name, in the same clean runs as the thresholds of single channels
THRESHOLD = 50.0
LEAST = 1.5  # K rms between the two while they are swapped: as of single channels
_TRIED = 4  # pairs that are looked at closely


@dataclass(frozen=True)
class Exchange:
    """A pair, and from when on its channels are swapped."""

    channels: tuple[int, int]
    history: History
    statistic: float  # twice the log-likelihood ratio


def exchanges(
    r: Readings, predictions: Mapping[int, Prediction], usual: float, gone: tuple[int, ...] = ()
) -> Exchange | None:
    """The likeliest exchange of two channels that is worth a name, None where there is none.

    predictions: of every channel that may be one of them, by all others but those that are gone.

    All pairs and onsets are looked at first at one size of the discrepancy, the best then closely.
    """
    whole = [c for c in predictions if np.isfinite(r.values[:, c]).all()]
    if len(whole) < 3:
        return None
    spans = _spans(r)
    gains = {c: _gains(r, c, predictions[c], usual, whole, spans) for c in whole}
    found = []
    for i, a in enumerate(whole):
        for b in whole[i + 1 :]:
            both = [ga + gb for ga, gb in zip(gains[a][b], gains[b][a], strict=True)]
            s = int(np.argmax([g.max() for g in both]))
            onset = int(np.argmax(both[s]))
            found.append((float(both[s][onset]), (a, b), spans[s], onset))
    best: Exchange | None = None
    for rough, pair, span, onset in sorted(found, key=lambda f: -f[0])[:_TRIED]:
        if rough < THRESHOLD / 4.0:
            break
        rows = span.rows[onset:]
        apart = float(np.sqrt(np.mean((r.values[rows, pair[0]] - r.values[rows, pair[1]]) ** 2)))
        gain = _exact(r, pair, rows, usual, gone) if apart >= LEAST else 0.0
        if gain > (best.statistic if best is not None else THRESHOLD):
            best = Exchange(pair, History("leap" if onset else "offset", int(rows[0]), span.runs), gain)
    return best


@dataclass(frozen=True)
class _Span:
    """Rows of one run, or of all runs from one on, in which a swap may begin in the first run and go on to the end."""

    rows: np.ndarray  # (m,)
    runs: tuple[int, ...]
    onsets: int  # of these rows, those of the first run


def _spans(r: Readings) -> list[_Span]:
    """In time: one run, or one and all that follow."""
    present = [k for k in range(r.runs) if (r.run == k).any()]
    result = []
    for k in present:
        own = np.flatnonzero(r.run == k)
        later = tuple(n for n in present if n > k)
        result.append(_Span(own, (k,), len(own)))
        if later:
            result.append(_Span(np.flatnonzero(np.isin(r.run, (k, *later))), (k, *later), len(own)))
    return result


def _gains(
    r: Readings, channel: int, prediction: Prediction, usual: float, partners: Sequence[int], spans: Sequence[_Span]
) -> dict[int, list[np.ndarray]]:
    """Per partner and span: twice the gain in log-likelihood (onsets,) of one channel if it showed the partner.

    With D the difference of both and P the precision, -2 Dᵀ P y - Dᵀ P D over the rows from the onset on: for all
    onsets at once by sums from the end. The partner is no predictor then: its column x leaves the covariance by the
    formula of Sherman and Morrison. A swap that always is cannot be seen in the runs themselves.
    """
    y, P = prediction.above, prediction.precision(usual)
    others = [c for c in partners if c != channel]
    D = r.values[:, others] - r.values[:, [channel]]
    x = D + y[:, None]  # above the median of the others, as y is
    Px = P @ x
    left = prediction.weight / np.maximum(1.0 - prediction.weight * np.einsum("np,np->p", x, Px), 1e-9)
    Py = (P @ y)[:, None] + left * Px * (y @ Px)
    result: dict[int, list[np.ndarray]] = {c: [] for c in others}
    for span in spans:
        d, s, own = D[span.rows], Px[span.rows], P[np.ix_(span.rows, span.rows)]
        above = np.triu(own, 1) @ d + left * s * (_from_the_end(s * d) - s * d)
        square = d * (2.0 * above + (np.diag(own)[:, None] + left * s**2) * d)
        gain = _from_the_end(-2.0 * d * Py[span.rows] - square)[: span.onsets]
        if len(span.runs) == r.runs:
            time = r.time[span.rows[: span.onsets]]
            gain[time - time[0] < BEFORE] = -np.inf
        for k, c in enumerate(others):
            result[c].append(gain[:, k])
    return result


def _from_the_end(values: np.ndarray) -> np.ndarray:
    """Sums over each row and all that follow (m, p)."""
    return np.cumsum(values[::-1], axis=0)[::-1]


def _exact(r: Readings, pair: tuple[int, int], rows: np.ndarray, usual: float, gone: tuple[int, ...]) -> float:
    """Twice the gain in log-likelihood of both channels, predicted without each other."""
    a, b = pair
    away = (*gone, a, b)
    if not predictors(r, a, away):
        return 0.0
    values = r.values.copy()
    values[rows, a], values[rows, b] = r.values[rows, b], r.values[rows, a]
    exchanged = replace(r, values=values)
    without = {c: tuple(w for w in away if w != c) for c in pair}
    before = sum(Prediction.of(r, c, without[c]).likelihood(usual) for c in pair)
    return 2.0 * (sum(Prediction.of(exchanged, c, without[c]).likelihood(usual) for c in pair) - before)
