"""Temperature channels that are at fault without any model: stuck ones, found before anything is fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twin.diagnose.diagnosis import Cause, Window
from twin.logs.run import Run
from twin.logs.stuck import standstills

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
        for still in standstills(table):
            start, end = float(table.time[still.first]), float(table.time[still.last])
            if still.name not in sensors or end - start < LEAST:
                continue
            frozen = columns[still.name].copy()
            frozen[still.first : still.last + 1] = np.nan
            columns[still.name] = frozen
            causes.append(
                Cause(
                    "sensor", f"sensors.{still.name}", "", float("nan"), (float("nan"), float("nan")), "K",
                    float("inf"), 0.0, history="stuck", windows=(Window(name, start, end),),
                )
            )  # fmt: skip
        result.append(replace(run, temperatures=replace(table, columns=columns)))
    return result, causes
