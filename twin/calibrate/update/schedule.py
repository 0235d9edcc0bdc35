"""When to measure: where the error that a measurement takes away is worth the interruption (0.33: about 5 min).

A machine whose predicted standard deviation sigma equals its tolerance makes nothing of use; below it, the loss is
taken as (sigma / tolerance)^2 of the production, per axis the worst. A measurement lowers sigma at once, and how much
is known before it is made: the covariance does not depend on what will be measured. It is asked for where, over the
time that it is expected to last,

    ((sigma_before / tolerance)^2 - (sigma_after / tolerance)^2) * horizon > interruption

or where sigma exceeds the tolerance. So little is asked where the base model is right, much after a change.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Schedule:
    """A scheduler: an `Asker` of `twin.calibrate.update.plan`."""

    tolerance: float  # m, of the standard deviation of the predicted TCP error, of the worst axis
    interruption: float = 300.0  # s of production that a measurement takes
    horizon: float = 3600.0  # s, for which its benefit counts
    least: float = 900.0  # s between measurements
    check: float = 300.0  # s between looks

    def __call__(self, time: float, last: float, sigma: Callable[[], tuple[np.ndarray, np.ndarray]]) -> bool:
        """Whether to measure now; see `Asker`."""
        if time < last + self.least or time % self.check > 1e-6:
            return False
        before, after = sigma()
        if float(before.max()) > self.tolerance:
            return True
        gain = float(np.max(before**2 - after**2)) / self.tolerance**2
        return gain * self.horizon > self.interruption
