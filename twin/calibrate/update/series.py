"""Tests of paper 003 replayed online: a base model of one output, updated by sparse measurements of it.

What `twin update` does with a run and an artefact, for any series: tests are heating phases glued together, each with
its own initial state (erratum E-003-7).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.calibrate.transfer_function.model import pieces
from twin.calibrate.update import gain_filter
from twin.calibrate.update.gain_filter import GainPrior


@dataclass(frozen=True)
class Lived:
    """n rows, each predicted before it could be used."""

    predicted: np.ndarray  # (n,) m
    sigma: np.ndarray  # (n,) m, of the prediction's error, without measurement noise; NaN for the method of the paper
    used: np.ndarray  # (n,) bool
    rejected: int


def replay_online(
    prior: GainPrior,
    time: np.ndarray,
    base: np.ndarray,
    measured: np.ndarray,
    noise: float,
    interval: float,
    starts: Sequence[int] = (0,),
) -> Lived:
    """The bounded gain filter over tests one after the other: rows at times (n,) s since the start of their test, the
    base model (n,) m and what was measured (n,) m with a standard deviation `noise` [m]. A row is used at every
    multiple of `interval` [s]; starts: first rows of tests."""
    predicted, sigma = np.zeros((2, len(time)))
    used, rejected = np.zeros(len(time), dtype=bool), 0
    state = gain_filter.begin(prior, 0.0, 1)
    for number, (a, b) in enumerate(pieces(starts, len(time))):
        if number:
            state = gain_filter.begin_segment(prior, state, 0.0)
        slow = np.zeros(1)
        for k in range(a, b):
            slow = gain_filter.lagged(prior, slow, base[k : k + 1], float(time[k]) - state.time)
            state = gain_filter.wait(prior, state, float(time[k]))
            parts = np.column_stack([base[k : k + 1], slow])
            mean, deviation = gain_filter.predict(prior, state, parts)
            predicted[k], sigma[k] = mean[0], deviation[0]
            if _due(float(time[k]), interval):
                used[k] = True
                state, told = gain_filter.assimilate(prior, state, parts, measured[k : k + 1], noise)
                rejected += sum(not t.accepted for t in told)
    return Lived(predicted, sigma, used, rejected)


def replay_online_003(
    time: np.ndarray,
    base: np.ndarray,
    measured: np.ndarray,
    interval: float,
    starts: Sequence[int] = (0,),
) -> Lived:
    """The same with paper 003's eqs (7) and (8) as printed: a gain of 1 at the start of every test."""
    predicted, used = np.zeros(len(time)), np.zeros(len(time), dtype=bool)
    for a, b in pieces(starts, len(time)):
        gain = 1.0
        for k in range(a, b):
            predicted[k] = gain * base[k]
            if _due(float(time[k]), interval):
                used[k] = True
                gain = float(gain_filter.gain_003(base[k], measured[k]))
    return Lived(predicted, np.full(len(time), np.nan), used, 0)


def _due(time: float, interval: float) -> bool:
    return abs(time / interval - round(time / interval)) * interval < 1e-6 and time > 0.0
