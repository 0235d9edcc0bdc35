"""The temperature rise of members of given lags under the loads of a run, at the times of its measurements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from twin.calibrate.members.driver import Driver
from twin.logs.run import Run

# s: a factor of four from one to the next, from what follows at once (within a step of the runtime) to a machine bed.
# Sums of these resemble any lag between them; with a factor of two nothing was predicted better (docs/members.md).
LAGS = (60.0, 300.0, 1200.0, 4800.0, 19200.0)
STEP = 60.0  # s of the grid that is integrated: the shortest lag


@dataclass(frozen=True)
class Candidate:
    """A member that is not in the model."""

    driver: Driver
    lag: float  # s

    @property
    def words(self) -> str:
        """ "follows t4 with 40 min"."""
        return f"follows {self.driver.words} with {duration(self.lag)}"


def duration(lag: float) -> str:
    """[s] as "40 min", "2.7 h"."""
    return f"{lag / 60.0:.3g} min" if lag < 5400.0 else f"{lag / 3600.0:.2g} h"


def short(lag: float) -> str:
    """[s] as it stands in a name: "20min"."""
    return f"{lag / 60.0:.4g}min"


def candidates(drivers: Sequence[Driver], lags: Sequence[float] = LAGS) -> tuple[Candidate, ...]:
    """Every driver with every lag; heat that is felt at once is none: a body warms up in its own time."""
    return tuple(Candidate(d, lag) for d in drivers for lag in lags if d.is_temperature or lag > LAGS[0])


def responses(run: Run, members: Sequence[Candidate], time: np.ndarray) -> np.ndarray:
    """Rises (k, c) [K] of members at times (k,) [s]: at the start they rest at what they follow, without heat.

    The driver is averaged over steps of STEP and held, as the runtime does (`twin.rom.drive`); the first-order lag is
    then exact, tau dT/dt = u - T.
    """
    begin, end = float(run.loads.time[0]), float(run.loads.time[-1])
    edges = begin + STEP * np.arange(max(2, int(np.ceil((end - begin) / STEP)) + 1))
    found, means = np.zeros((len(time), len(members))), {}
    for k, member in enumerate(members):
        if member.driver not in means:
            means[member.driver] = _step_means(member.driver, run, edges)
        keep = np.exp(-STEP / member.lag)
        rise = np.concatenate([[0.0], lfilter([1.0 - keep], [1.0, -keep], means[member.driver])])
        found[:, k] = np.interp(time, edges, rise)
    return found


def _step_means(driver: Driver, run: Run, edges: np.ndarray) -> np.ndarray:
    """Means (n,) over the steps: temperatures straight between readings, loads held until the next."""
    time, values = driver.values(run)
    if driver.is_temperature:
        fine = np.union1d(np.clip(time, edges[0], edges[-1]), edges)
        at = np.interp(fine, time, values)
        area = np.concatenate([[0.0], np.cumsum(np.diff(fine) * 0.5 * (at[1:] + at[:-1]))])
    else:
        fine = np.union1d(np.clip(time, edges[0], edges[-1]), edges)
        held = values[np.clip(np.searchsorted(time, fine[:-1], side="right") - 1, 0, None)]
        area = np.concatenate([[0.0], np.cumsum(np.diff(fine) * held)])
    return np.diff(np.interp(edges, fine, area)) / np.diff(edges)
