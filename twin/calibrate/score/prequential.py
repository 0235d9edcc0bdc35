"""Scoring before assimilating: every TCP measurement is predicted before the predictor is told of it (E-000-7).

A model that is corrected by an R-test agrees with that R-test whatever it is worth. So only what was measured earlier
may be used, and a predictor that copies the last R-test scores what `HoldLast` scores.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

SAME_PLACE = 1e-3  # m
ONE_EVENT = 600.0  # s: an R-test with its positions; paper 000 needs 5 min


class Predictor(Protocol):
    """Anything that predicts TCP errors and learns from their measurements."""

    def predict(self, time: float, position: np.ndarray) -> np.ndarray:
        """TCP error (3,) m at a time [s] and a position (n_axes,) [m]."""
        ...

    def assimilate(self, time: float, position: np.ndarray, measured: np.ndarray) -> None:
        """Learn a measurement (3,) m; NaN: that component was not measured."""
        ...


def prequential(predictor: Predictor, time: np.ndarray, position: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Predictions (n, 3) m for measurements (n, 3) at times (n,) and positions (n, n_axes), none of which saw its own.

    In the order of time; measurements of one time are all predicted before any of them is assimilated.
    """
    predicted = np.full(measured.shape, np.nan)
    order = np.argsort(time, kind="stable")
    same = np.split(order, np.flatnonzero(np.diff(time[order])) + 1) if len(order) else []
    for rows in same:
        for row in rows:
            predicted[row] = predictor.predict(float(time[row]), position[row])
        for row in rows:
            predictor.assimilate(float(time[row]), position[row], measured[row])
    return predicted


class HoldLast:
    """The last measurement at the same place, else the last one anywhere, else zero: what any model has to beat.

    interval [s]: assimilate no more often than that; the measurements that follow within 10 min at other places are
    part of the same R-test. 0: assimilate all.
    """

    def __init__(self, interval: float = 0.0, n: int = 3):
        self._interval = interval
        self._event = -np.inf  # when the last R-test began
        self._seen: list[np.ndarray] = []  # places of this R-test
        self._places: np.ndarray | None = None  # (m, n_axes)
        self._values = np.zeros((0, n))  # (m, n) last measurement at each place
        self._last = np.zeros(n)

    def predict(self, time: float, position: np.ndarray) -> np.ndarray:
        """(n,) m; the time does not matter."""
        k = self._place(position)
        return self._last.copy() if k is None else np.where(np.isfinite(self._values[k]), self._values[k], self._last)

    def assimilate(self, time: float, position: np.ndarray, measured: np.ndarray) -> None:
        """Keep a measurement (n,) m, if the interval allows it."""
        if self._interval > 0.0:
            if time >= self._event + self._interval:
                self._event, self._seen = time, []
            elif time > self._event + ONE_EVENT or any(_near(position, p) for p in self._seen):
                return
            self._seen.append(position)
        known = np.isfinite(measured)
        self._last = np.where(known, measured, self._last)
        k = self._place(position)
        if k is None:
            new = np.asarray(position, dtype=float)[None]
            self._places = new if self._places is None else np.concatenate([self._places, new])
            self._values = np.concatenate([self._values, measured[None]])
        else:
            self._values[k] = np.where(known, measured, self._values[k])

    def _place(self, position: np.ndarray) -> int | None:
        if self._places is None:
            return None
        near = (np.abs(self._places - position) <= SAME_PLACE).all(axis=1)
        return int(np.argmax(near)) if near.any() else None


def _near(a: np.ndarray, b: np.ndarray) -> bool:
    return bool((np.abs(a - b) <= SAME_PLACE).all())
