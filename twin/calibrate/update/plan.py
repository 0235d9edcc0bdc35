"""Which TCP measurements an update uses: all, some an interval apart, or those that a scheduler asked for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from twin.calibrate.score.prequential import SAME_PLACE

SAME_EVENT = 299.0  # s: rows at other places within 5 min belong to one R-test (0.33: so long does it take)


class Asker(Protocol):
    """A scheduler: whether a measurement is worth its interruption."""

    def __call__(self, time: float, last: float, sigma: Callable[[], tuple[np.ndarray, np.ndarray]]) -> bool:
        """time, last [s]: now and of the last measurement; sigma(): standard deviations (3,) m before and after one."""
        ...


class Plan:
    """Which rows of tcp.csv are used: all, those an interval apart, or those that a scheduler asked for."""

    def __init__(self, interval: float | None = None, ask: Asker | None = None):
        self.interval, self.ask = interval, ask
        self.asked: list[float] = []
        self._last, self._wanted = -np.inf, False
        self._places: list[np.ndarray] = []  # of the R-test that was used last

    def uses(self, time: float, position: np.ndarray) -> bool:
        """Whether a row is used; rows are asked about in the order of time, one by one.

        Rows at other places within 5 min of a used one belong to the same R-test, and are used with it.
        """
        new = all(np.abs(position - place).max(initial=0.0) > SAME_PLACE for place in self._places)
        if time < self._last + SAME_EVENT and new:
            self._places.append(position)
            return True
        if self.ask is not None:
            use = self._wanted
        else:
            use = self.interval is None or time >= self._last + self.interval - 1.0
        if use:
            self._last, self._wanted, self._places = time, False, [position]
        return use

    def consider(self, time: float, sigma: Callable[[], tuple[np.ndarray, np.ndarray]]) -> None:
        """Let the scheduler ask for the next row."""
        if self.ask is not None and not self._wanted and self.ask(time, self._last, sigma):
            self._wanted = True
            self.asked.append(time)
