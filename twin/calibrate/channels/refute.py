"""Channels that all others refute: one after the other, the one whose removal leaves the others in agreement."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from twin.calibrate.channels.exchange import THRESHOLD as EXCHANGE
from twin.calibrate.channels.exchange import Exchange, exchanges
from twin.calibrate.channels.finding import Finding
from twin.calibrate.channels.prediction import Prediction, Scan, predictors, usual_size
from twin.calibrate.channels.readings import Readings
from twin.calibrate.channels.shapes import Histories, History, Shape, histories

# Of a statistic, for a name. In clean pairs and triples of every other day of a lathe leaps and drifts of LEAST reach
# 57 where the machine itself begins to heat beside one sensor; offsets, of which there are few histories, 10
THRESHOLDS: dict[Shape, float] = {"leap": 70.0, "drift": 70.0, "offset": 25.0}
# Of an offset in all runs: a place that is always warm looks alike, and beside the mix nothing says how warm one may be
ALWAYS = 60.0
LEAST = 1.5  # K that are worth a name: a thermocouple of class 1 may be off by that (IEC 60584-1)
FEWEST = 4  # other channels, to say which one is off
_MOST = 3  # a third of the channels: with more refuted, nobody can tell who is right
_SUSPECTS = 3  # candidates that are removed for a trial, before one is named


@dataclass(frozen=True)
class Suspect:
    """The most likely fault of one channel."""

    channel: int
    history: History
    statistic: float
    least: float  # of the statistic, for a name
    amplitude: float  # K
    sigma: float  # K


def nothing(_: Finding) -> bool:
    """What explains a finding where nothing is known but the channels."""
    return False


def refuted(
    r: Readings, leaps: Sequence[tuple[int, str, float]] = (), explained: Callable[[Finding], bool] = nothing
) -> list[Finding]:
    """Channels that read LEAST or more beside what all others say of them, most likely first.

    leaps: (run, channel, time [s]) of those that rows of the run itself show: when these begin need not be looked for.
    explained: whether something else explains a finding; such a channel is a witness as all others are.
    """
    found: list[Finding] = []
    judged = [c for c in range(len(r.names)) if np.isfinite(r.values[:, c]).any()]
    if len(judged) <= FEWEST or any(len(predictors(r, c)) < FEWEST for c in judged):
        return found
    of = histories(r)
    least = _thresholds(r, of, leaps)
    predictions = {c: Prediction.of(r, c) for c in judged}
    usual = usual_size(predictions.values())
    gone: tuple[int, ...] = ()
    while len(gone) * _MOST < len(judged):
        left = [c for c in judged if c not in gone]
        if len(left) <= FEWEST:
            break
        suspects = [s for s in _suspects(predictions, of, least, usual) if not explained(_told(r, s))]
        pair = exchanges(r, predictions, usual, gone)
        if pair is not None and not explained(_pair(r, pair)) and pair.statistic > _beside(suspects, pair):
            found.append(_pair(r, pair))
        elif suspects:
            found.append(_told(r, _to_blame(r, suspects, left, of, least, usual, gone)))
        else:
            break
        gone += tuple(r.names.index(n) for n in found[-1].channels)
        predictions = {c: Prediction.of(r, c, gone) for c in left if c not in gone}
    return found


def _thresholds(r: Readings, of: Histories, leaps: Sequence[tuple[int, str, float]]) -> np.ndarray:
    """(c, k) of the statistic of every channel and history. A leap at a known time is one history, as an offset is."""
    least = np.array(
        [ALWAYS if h.shape == "offset" and len(h.runs) == r.runs > 1 else THRESHOLDS[h.shape] for h in of.of]
    )
    result = np.tile(least, (len(r.names), 1))
    for k, h in enumerate(of.of):
        for run, name, start in leaps if h.shape == "leap" else ():
            if name in r.names and h.runs[0] == run and abs(r.time[h.first] - start) <= r.length:
                result[r.names.index(name), k] = THRESHOLDS["offset"]
    return result


def _suspects(predictions: Mapping[int, Prediction], of: Histories, least: np.ndarray, usual: float) -> list[Suspect]:
    """Channels with a fault that is worth a name, the most likely first."""
    found = [
        s for s in (_suspect(c, p.scan(of.columns, usual), of, least[c]) for c, p in predictions.items())
        if s is not None
    ]  # fmt: skip
    return sorted(found, key=lambda s: -s.statistic)


def _suspect(channel: int, scan: Scan, of: Histories, least: np.ndarray) -> Suspect | None:
    worth = np.where((np.abs(scan.amplitude) >= LEAST) & (scan.statistic >= least), scan.statistic, 0.0)
    k = int(np.argmax(worth))
    if worth[k] == 0.0:
        return None
    return Suspect(channel, of.of[k], float(worth[k]), float(least[k]), float(scan.amplitude[k]), float(scan.sigma[k]))


def _to_blame(
    r: Readings, suspects: Sequence[Suspect], channels: Sequence[int], of: Histories, least: np.ndarray, usual: float,
    gone: tuple[int, ...],
) -> Suspect:  # fmt: skip
    """The suspect without which the others agree best: a faulty channel is a predictor of all others."""
    if len(suspects) == 1:
        return suspects[0]

    def left(s: Suspect) -> float:
        away = (*gone, s.channel)
        others = _suspects({c: Prediction.of(r, c, away) for c in channels if c != s.channel}, of, least, usual)
        return max((o.statistic for o in others), default=0.0)

    return min(suspects[:_SUSPECTS], key=lambda s: (left(s), -s.statistic))


def _beside(suspects: Sequence[Suspect], pair: Exchange) -> float:
    """What the likeliest faults of a pair's channels explain, each by itself, or the likeliest of any other channel."""
    own = sum(s.statistic for s in suspects if s.channel in pair.channels)
    return max([own, *(s.statistic for s in suspects if s.channel not in pair.channels)])


def _pair(r: Readings, e: Exchange) -> Finding:
    start, end = _times(r, e.history)
    names = tuple(r.names[c] for c in e.channels)
    return Finding("swapped", names, e.history.runs, start, end, np.nan, (np.nan, np.nan), e.statistic, EXCHANGE)


def _told(r: Readings, s: Suspect) -> Finding:
    start, end = _times(r, s.history)
    spread = 1.96 * s.sigma
    return Finding(
        s.history.shape, (r.names[s.channel],), s.history.runs, start, end, s.amplitude,
        (s.amplitude - spread, s.amplitude + spread), s.statistic, s.least,
    )  # fmt: skip


def _times(r: Readings, history: History) -> tuple[float, float]:
    """Edges of bins [s]; what is so throughout begins before the first row."""
    last = np.flatnonzero(r.run == history.runs[-1])[-1]
    begins = float(r.time[history.first] - r.length / 2)
    return min(0.0, begins - r.length) if history.shape == "offset" else begins, float(r.time[last] + r.length / 2)
