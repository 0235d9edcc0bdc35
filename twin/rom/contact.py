"""Moving contacts: which segments of a rail face a pad, and the conductance matrix that follows.

Paper 000, eq (1): a pad at distance dx_i from station i, stations x_i apart, sees

    w = (x_i - dx_i)/x_i * u_i + dx_i/x_i * u_{i+1}

for displacements, and here likewise for temperatures. Forces and heat use the transpose, so both are conserved.
While the axis moves within a time step the pad dwells on several segments: the step uses the dwell-time mean of
d d^T (d = pad minus weighted segments), not d d^T of the mean position: a sweeping pad carries heat along the rail.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


def station_weights(stations: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Interpolation of eq (1): left station index i (m,) and right weight dx_i/x_i (m,) for coordinates s (m,) [m].

    Outside the stations the pad holds at the first or last one (weight 0 or 1); `twin check` refuses strokes that
    get there, and the runtime flags it.
    """
    i = np.clip(np.searchsorted(stations, s, side="right") - 1, 0, len(stations) - 2)
    weight = (s - stations[i]) / (stations[i + 1] - stations[i])
    return i, np.clip(weight, 0.0, 1.0)


def segment_borders(stations: np.ndarray) -> np.ndarray:
    """Borders (n - 1,) [m] between the segments around stations (n,)."""
    return (stations[:-1] + stations[1:]) / 2


@dataclass(frozen=True)
class Dwell:
    """Dwell-time means of the weights w of one pad on the n segments of its rail, per step (leading axis)."""

    mean: np.ndarray  # (n_steps, n) mean of w_i; each row sums to 1
    square: np.ndarray  # (n_steps, n) mean of w_i^2
    neighbour: np.ndarray  # (n_steps, n - 1) mean of w_i w_{i+1}


def dwell_by_segment(
    stations: np.ndarray, s: np.ndarray, step: np.ndarray, time_weight: np.ndarray, n_steps: int
) -> Dwell:
    """The same with all of a pad's heat and conductance on the segment below it (local assignment, paper 001, 1.05).

    Arguments as in `dwell`; the pad's path must be cut at the borders of segments (`segment_borders`).
    """
    n = len(stations)
    cell = step * n + np.searchsorted(segment_borders(stations), s)
    share = np.bincount(cell, weights=time_weight, minlength=n_steps * n).reshape(n_steps, n)
    return Dwell(mean=share, square=share, neighbour=np.zeros((n_steps, n - 1)))


def dwell(stations: np.ndarray, s: np.ndarray, step: np.ndarray, time_weight: np.ndarray, n_steps: int) -> Dwell:
    """Dwell-time means over steps from samples of the pad coordinate.

    s (m,) [m] pad coordinate; step (m,) int index of the step each sample belongs to; time_weight (m,) the sample's
    share of its step (sums to 1 per step).
    """
    n = len(stations)
    i, right = station_weights(stations, s)
    left = 1.0 - right
    cell = step * n + i

    def mean(values: np.ndarray, index: np.ndarray) -> np.ndarray:
        return np.bincount(index, weights=values * time_weight, minlength=n_steps * n).reshape(n_steps, n)

    return Dwell(
        mean=mean(left, cell) + mean(right, cell + 1),
        square=mean(left**2, cell) + mean(right**2, cell + 1),
        neighbour=mean(left * right, cell)[:, : n - 1],
    )
