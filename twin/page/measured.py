"""What was measured in the run that a result is of, beside what was computed: dots on the curves of a page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from twin.errors import TwinError
from twin.logs.read import read_run
from twin.pictures.result import Drawn

DOTS = 240  # readings of a channel that are drawn at most


def measured_told(run: Path, result: Drawn, rows: np.ndarray) -> dict[str, Any] | None:
    """Readings of sensors [degC] and of the TCP [m] at the drawn rows (k,) nearest to them; None where there are none.

    The run is where summary.json says that it was; one that has moved, or that a page is made without, is no error.
    """
    if not run.is_dir():
        return None
    try:
        logged = read_run(run)
    except TwinError:
        return None
    start = float(logged.loads.time[0])

    def dots(time: np.ndarray, values: np.ndarray) -> list[list[float]]:
        """(row, value), thinned; readings beyond the drawn time are left out."""
        hours = (time - start) / 3600.0
        kept = np.flatnonzero(np.isfinite(values) & (hours >= 0.0) & (hours <= result.hours[-1]))
        kept = kept[:: max(1, -(-len(kept) // DOTS))]
        at = np.abs(result.hours[rows][None, :] - hours[kept][:, None]).argmin(axis=1)
        return [[int(row), float(value)] for row, value in zip(at, values[kept], strict=True)]

    table, tcp = logged.temperatures, logged.tcp
    sensors = {n: dots(table.time, table.columns[n]) for n in result.sensors if n in table.columns} if table else {}
    told = {"sensors": sensors, "tcp": [dots(tcp.time, d) for d in tcp.displacement.T] if tcp else []}
    return told if sensors or told["tcp"] else None
