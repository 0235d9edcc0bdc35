"""The measured channels of a run as series in time: one per temperature, one per component and place of the TCP."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from twin.logs.run import Run, Table

COMPONENTS = ("dx", "dy", "dz")
ROWS = 20  # a shorter series says nothing about what its channel usually does
_PLACE = 1e-6  # m or rad: positions nearer than a micrometre are one place


@dataclass(frozen=True)
class Series:
    """The readings of one channel at one place, without empty cells."""

    table: str  # "temperatures" or "tcp"
    name: str
    unit: str  # "degC" or "m"
    row: np.ndarray  # (n,) rows of the table, increasing
    time: np.ndarray  # (n,) s
    values: np.ndarray  # (n,)

    @property
    def resolution(self) -> float:
        """The smallest change that it ever shows, 0 where it shows none: of a rounded channel its last digit."""
        change = np.abs(np.diff(self.values))
        change = change[change > 1e-9 * max(float(np.ptp(self.values)), 1e-300)]
        return float(change.min()) if len(change) else 0.0

    def only(self, keep: np.ndarray) -> Series:
        """The readings that a mask (n,) keeps."""
        return Series(self.table, self.name, self.unit, self.row[keep], self.time[keep], self.values[keep])


def temperature_series(run: Run) -> list[Series]:
    """One per column of temperatures.csv that has readings enough."""
    if run.temperatures is None:
        return []
    time, columns = run.temperatures.time, run.temperatures.columns
    return long_enough(_series("temperatures", n, "degC", time, v, np.arange(len(v))) for n, v in columns.items())


def tcp_series(run: Run) -> list[Series]:
    """One per component and place of tcp.csv that has readings enough: rows at other places are another history."""
    if run.tcp is None or not len(run.tcp.time):
        return []
    n = len(run.tcp.time)
    place = np.column_stack([np.zeros(n), run.tcp.position, *run.tcp.angle.values()])
    _, group = np.unique(np.round(np.nan_to_num(place) / _PLACE), axis=0, return_inverse=True)
    group = group.reshape(-1)
    rows = [np.flatnonzero(group == g) for g in np.flatnonzero(np.bincount(group) >= ROWS)]
    return long_enough(
        _series("tcp", name, "m", run.tcp.time, run.tcp.displacement[:, k], at)
        for k, name in enumerate(COMPONENTS)
        for at in rows
    )


def beside(series: Series, others: Table | None) -> dict[str, np.ndarray]:
    """The columns of another table (n,) at the times of a series, the last row before each; none without a table."""
    if others is None or not len(others.time):
        return {}
    at = np.clip(np.searchsorted(others.time, series.time, side="right") - 1, 0, None)
    return {name: values[at] for name, values in others.columns.items()}


def _series(table: str, name: str, unit: str, time: np.ndarray, values: np.ndarray, rows: np.ndarray) -> Series:
    rows = rows[np.isfinite(values[rows])]
    return Series(table, name, unit, rows, time[rows], values[rows])


def long_enough(series: Iterable[Series]) -> list[Series]:
    """Those with readings enough to say what is usual."""
    return [s for s in series if len(s.row) >= ROWS]
