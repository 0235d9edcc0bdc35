"""Load samples cut at the borders of time steps and at the stations of a rail, so that means over steps are exact.

Two conventions for what a log says between its samples:
- scalar loads (current, speed, temperature) hold until the next sample;
- positions run linearly to the next sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Intervals:
    """The time axis cut at all samples and all step edges; k intervals in order of time, none across an edge."""

    start: np.ndarray  # (k,) s
    end: np.ndarray  # (k,) s
    sample: np.ndarray  # (k,) index of the sample that holds
    step: np.ndarray  # (k,) index of the step
    share: np.ndarray  # (k,) share of the step's length; sums to 1 per step
    first: np.ndarray  # (n_steps,) index of the first interval of each step

    @property
    def n_steps(self) -> int:
        return len(self.first)

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Means over steps (n_steps, ...) of held samples (m, ...).

        What is constant within a step stays so to the last digit, so that a resting machine keeps its factor.
        """
        share = self.share.reshape(-1, *(1,) * (values.ndim - 1))
        held = values[self.sample]
        base = held[self.first]
        return base + np.add.reduceat((held - base[self.step]) * share, self.first, axis=0)

    def mean_of_path(self, path: np.ndarray) -> np.ndarray:
        """Means over steps (n_steps,) of a path that is linear between its values at the borders (k + 1,)."""
        middle = 0.5 * (path[:-1] + path[1:])
        base = middle[self.first]
        return np.asarray(base + np.add.reduceat((middle - base[self.step]) * self.share, self.first))

    def part(self, begin: int, end: int) -> Intervals:
        """The intervals of steps begin .. end, with steps and samples counted from the first of them."""
        here = slice(self.first[begin], self.first[end] if end < self.n_steps else len(self.start))
        sample = self.sample[here]
        return Intervals(
            self.start[here],
            self.end[here],
            sample - sample[0],
            self.step[here] - begin,
            self.share[here],
            self.first[begin:end] - self.first[begin],
        )

    def merged(self, group: np.ndarray) -> Intervals:
        """With samples counted by `group` (n_samples,); neighbours of one group and step are one interval."""
        of = group[self.sample]
        begin = np.flatnonzero(np.append(True, (np.diff(of) != 0) | (np.diff(self.step) != 0)))
        step = self.step[begin]
        return Intervals(
            self.start[begin],
            self.end[np.append(begin[1:], len(of)) - 1],
            of[begin],
            step,
            np.add.reduceat(self.share, begin),
            np.searchsorted(step, np.arange(self.n_steps)),
        )

    def constant(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """True for steps (n_steps,) in which a path from `start` to `end` (k,) of each interval stays put."""
        low = np.minimum.reduceat(np.minimum(start, end), self.first)
        high = np.maximum.reduceat(np.maximum(start, end), self.first)
        return low == high

    def any(self, values: np.ndarray) -> np.ndarray:
        """True for steps (n_steps, ...) in which a condition (k, ...) of the intervals holds for a time that counts."""
        counts = (self.share > 1e-9).reshape(-1, *(1,) * (values.ndim - 1))  # not a touch by rounding
        return np.logical_or.reduceat(values & counts, self.first, axis=0)


def cut(time: np.ndarray, edges: np.ndarray) -> Intervals:
    """Cut held samples at step edges.

    time (m,) [s] strictly increasing with time[0] == edges[0]; edges (n_steps + 1,) [s]. The last sample holds to the
    end; samples after the last edge are left out.
    """
    inside = time[(time > edges[0]) & (time < edges[-1])]
    borders = np.union1d(inside, edges)
    start, end = borders[:-1], borders[1:]
    step = np.searchsorted(edges, start, side="right") - 1
    n_steps = len(edges) - 1
    duration = end - start
    first = np.searchsorted(step, np.arange(n_steps))
    total = np.add.reduceat(duration, first)
    sample = np.searchsorted(time, start, side="right") - 1
    return Intervals(start, end, sample, step, duration / total[step], first)


# Gauss points of an interval of length 1: weights w, w^2 and w_i w_{i+1} are quadratic in time between two stations,
# so two points integrate them exactly.
_GAUSS = np.array([0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0)])


@dataclass(frozen=True)
class PathPoints:
    """Quadrature points of a pad's path: exact for everything quadratic between two stations."""

    s: np.ndarray  # (p,) m
    interval: np.ndarray  # (p,) index of the interval each point belongs to
    share: np.ndarray  # (p,) share of that interval's length; sums to 1 per interval


def path_points(stations: np.ndarray, start: np.ndarray, end: np.ndarray) -> PathPoints:
    """Points of linear paths from `start` (k,) to `end` (k,) [m], cut wherever a path crosses a station (n,) [m]."""
    region_start = np.searchsorted(stations, start)  # region r lies between stations r - 1 and r
    region_end = np.searchsorted(stations, end)
    pieces = np.abs(region_end - region_start) + 1
    interval = np.repeat(np.arange(len(start)), pieces)
    nth = np.arange(len(interval)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    a, b = start[interval], end[interval]
    ascending = region_end[interval] > region_start[interval]
    # Border number j of an ascending path is station region_start + j - 1, of a descending one region_start - j.
    entry = np.where(ascending, region_start[interval] + nth - 1, region_start[interval] - nth)
    leave = np.where(ascending, entry + 1, entry - 1)
    last = len(stations) - 1
    piece_start = np.where(nth == 0, a, stations[np.clip(entry, 0, last)])
    piece_end = np.where(nth == pieces[interval] - 1, b, stations[np.clip(leave, 0, last)])
    length = b - a
    share = np.where(length == 0.0, 1.0, (piece_end - piece_start) / np.where(length == 0.0, 1.0, length))
    s = piece_start[:, None] + (piece_end - piece_start)[:, None] * _GAUSS
    return PathPoints(s.ravel(), np.repeat(interval, 2), np.repeat(0.5 * share, 2))
