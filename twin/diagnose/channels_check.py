"""Temperature channels that are at fault without any model: stuck ones, found before anything is fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twin.diagnose.diagnosis import Cause, Window
from twin.logs.run import Run
from twin.logs.stuck import stuck_temperatures

LEAST = 1800.0  # s that a channel must stand still


def stuck_sensors(runs: Sequence[Run], sensors: Sequence[str], names: Sequence[str]) -> tuple[list[Run], list[Cause]]:
    """Runs with the frozen stretch of every stuck sensor emptied, and a cause for each."""
    result, causes = [], []
    for run, name in zip(runs, names, strict=True):
        table = run.temperatures
        if table is None:
            result.append(run)
            continue
        columns = dict(table.columns)
        for problem in stuck_temperatures(table, ""):
            sensor = problem.what.split("'")[1]
            if sensor not in sensors:
                continue
            first, last = longest(columns[sensor])
            start, end = float(table.time[first]), float(table.time[last])
            if end - start < LEAST:
                continue
            frozen = columns[sensor].copy()
            frozen[first : last + 1] = np.nan
            columns[sensor] = frozen
            causes.append(
                Cause(
                    "sensor", f"sensors.{sensor}", "", float("nan"), (float("nan"), float("nan")), "K",
                    float("inf"), 0.0, history="stuck", windows=(Window(name, start, end),),
                )
            )  # fmt: skip
        result.append(replace(run, temperatures=replace(table, columns=columns)))
    return result, causes


def longest(values: np.ndarray) -> tuple[int, int]:
    """First and last row of the longest stretch of one value."""
    best, start = (0, 0), 0
    for i in range(1, len(values) + 1):
        if i == len(values) or values[i] != values[start]:
            if i - 1 - start > best[1] - best[0]:
                best = (start, i - 1)
            start = i
    return best
