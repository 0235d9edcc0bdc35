"""Temperature channels that are at fault without any model: stuck and broken ones, found before anything is fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from twin.calibrate.channels.exchange import THRESHOLD as EXCHANGE
from twin.calibrate.channels.finding import UNITS
from twin.calibrate.channels.judge import Judgement, set_aside
from twin.calibrate.channels.refute import THRESHOLDS, shape_of
from twin.diagnose.result.diagnosis import Cause, Window
from twin.logs.faults.breaks import rests_by_rounding
from twin.logs.faults.series import temperature_series
from twin.logs.faults.usable import BROKEN, usable
from twin.logs.run import Run, Table
from twin.logs.stuck import Standstill, frozen_throughout, standstills

LEAST = 1800.0  # s that a channel must stand still
REFUTED = "that all other channels refute"  # in the history of a channel: a leap that ...
_SAID = {"leap": "a leap", "offset": "an offset", "drift": "a drift", "swapped": "names"}


def stuck_sensors(runs: Sequence[Run], sensors: Sequence[str], names: Sequence[str]) -> tuple[list[Run], list[Cause]]:
    """Runs with the frozen stretch of every stuck sensor emptied, and a cause for each."""
    tables = {k: run.temperatures for k, run in enumerate(runs) if run.temperatures is not None}
    parted = [(k, still) for k, table in tables.items() for still in _stuck(runs[k], table)]
    tables, causes = _emptied(tables, parted, sensors, names)
    own = list(tables)
    whole = [(own[i], still) for i, still in frozen_throughout([tables[k] for k in own])]
    tables, more = _emptied(tables, whole, sensors, names)
    causes = sorted([*causes, *more], key=lambda c: names.index(c.windows[0].run))
    return [replace(run, temperatures=tables.get(k)) for k, run in enumerate(runs)], causes


def _stuck(run: Run, table: Table) -> list[Standstill]:
    """The standstills of temperatures, but those of a rounded channel at its maximum."""
    series = {s.name: s for s in temperature_series(run)}
    return [
        still for still in standstills(table)
        if (s := series.get(still.name)) is None or not rests_by_rounding(s, int(np.searchsorted(s.row, still.last)))
    ]  # fmt: skip


def broken_sensors(runs: Sequence[Run], sensors: Sequence[str], names: Sequence[str]) -> list[Cause]:
    """A cause for each sensor that breaks or leaps within a run, of the size of its first leap: `measured` leaves out
    what it shows from then on."""
    causes = []
    for run, name in zip(runs, names, strict=True):
        told = set[str]()
        for f in usable(run, sensors)[1]:
            for channel in (c for c in f.channels if f.kind in BROKEN and c in sensors and c not in told):
                told.add(channel)
                window = Window(name, f.first_time, f.last_time)
                history = "leap" if f.kind == "leap" else "broken"
                size = f.size if f.kind == "leap" else float("nan")
                causes.append(
                    Cause("sensor", f"sensors.{channel}", "", size, (size, size), "K", float("inf"), 0.0,
                          history=history, windows=(window,))
                )  # fmt: skip
    return causes


def refuted_sensors(runs: Sequence[Run], judgement: Judgement, names: Sequence[str]) -> tuple[list[Run], list[Cause]]:
    """Runs without the readings of sensors that all other channels refute, and a cause for each: found before anything
    is fitted, which a single wrong channel would drag along."""
    found = [f for f in judgement.findings if f.statistic < np.inf]  # the others are told already
    causes = []
    for f in found:
        least = EXCHANGE if f.what == "swapped" else THRESHOLDS[shape_of(f)]
        whole = [k for k in f.runs if f.what in ("offset", "drift") or k != f.runs[0]]
        ends = {k: _end(runs[k]) for k in f.runs}
        windows = tuple(Window(names[k], 0.0 if k in whole else f.start, ends[k]) for k in f.runs)
        place = f"sensors.{'<>'.join(f.channels)}"
        causes.append(
            Cause("sensor", place, "", f.size, f.interval, UNITS[f.what], f.statistic, least,
                  history=f"{_SAID[f.what]} {REFUTED}", windows=windows)
        )  # fmt: skip
    return set_aside(runs, found), causes


def _end(run: Run) -> float:
    assert run.temperatures is not None
    return float(run.temperatures.time[-1])


def _emptied(
    tables: Mapping[int, Table], found: Sequence[tuple[int, Standstill]], sensors: Sequence[str], names: Sequence[str]
) -> tuple[dict[int, Table], list[Cause]]:
    """Tables by run without the stretches of these sensors that last, and the causes."""
    result, causes = dict(tables), []
    for k, still in found:
        table = result[k]
        start, end = float(table.time[still.first]), float(table.time[still.last])
        if still.name not in sensors or end - start < LEAST:
            continue
        frozen = table.columns[still.name].copy()
        frozen[still.first : still.last + 1] = np.nan
        result[k] = replace(table, columns={**table.columns, still.name: frozen})
        causes.append(
            Cause(
                "sensor", f"sensors.{still.name}", "", float("nan"), (float("nan"), float("nan")), "K",
                float("inf"), 0.0, history="stuck", windows=(Window(names[k], start, end),),
            )
        )  # fmt: skip
    return result, causes
