"""A run without what is no measurement of its machine: a broken sensor, a leap, rows of another time, single wrong
readings, what a logger repeats.

One such channel decides a fit by least squares: it would be told as heat that nobody described. What is set aside is
told, never lost silently. What may have been the machine stays: leaps of several channels at once (a coolant that is
switched on), or between rows that are far apart.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from twin.logs.faults.fault import Fault, Kind
from twin.logs.faults.find import faults_of
from twin.logs.faults.tell import shown
from twin.logs.run import Run, Table, Tcp

BROKEN: tuple[Kind, ...] = ("noise", "rail", "leap")  # of temperatures: what a channel shows from there on is not known
NEAR = 120.0  # s between rows, beyond which a wetted surface (time constant 100 s and more) may seem to leap
MOST = 0.8  # of the sensors that a splice moves: a door that opens moves those in the air

BRIEF: tuple[Kind, ...] = ("spike", "held")  # readings of a channel that is sound before and after
_DOES = {
    "noise": "noise of", "spike": "leaps and comes back, by", "rail": "rests at", "leap": "leaps by",
    "stuck": "stands still at", "held": "repeats",
}  # fmt: skip


def usable(run: Run, sensors: Collection[str]) -> tuple[Run, tuple[Fault, ...]]:
    """The run with the cells of broken sensors emptied, the temperatures of all and the TCP rows after a splice as
    well, each until the next segment of the run begins; and the faults that this is for.

    sensors: columns of temperatures.csv on the machine. Air and foreign columns have no say, and stay.
    """
    table = run.temperatures
    named = [n for n in sensors if table is not None and n in table.columns]
    if table is None or not named:
        return run, ()
    aside = _aside(run, table, named)
    columns = {name: values.copy() for name, values in table.columns.items()}
    tcp = run.tcp
    for f in aside:
        for name in named if f.kind == "splice" else f.channels:
            columns[name][f.first_row : f.last_row + 1] = np.nan
        if f.kind == "splice" and tcp is not None:
            tcp = _without(tcp, f.first_time, f.last_time if f.last_row + 1 < len(table.time) else np.inf)
    return (replace(run, temperatures=replace(table, columns=columns), tcp=tcp), aside) if aside else (run, ())


def _aside(run: Run, table: Table, named: Sequence[str]) -> tuple[Fault, ...]:
    """The faults of these columns for which readings are set aside, in the order of time."""
    own = replace(table, columns={n: table.columns[n] for n in named}, units=dict.fromkeys(named, "degC"))
    found = [f for f in faults_of(replace(run, temperatures=own)) if f.table == "temperatures"]
    step = float(np.median(np.diff(table.time))) if len(table.time) > 1 else 0.0
    splices = [_ended(run, f) for f in found if f.kind == "splice" and len(f.channels) > MOST * len(named)]
    broken = [_ended(run, f) for f in found if f.kind in BROKEN and (f.kind != "leap" or _alone(f, step))]
    broken = [f for f in broken if not any(s.first_row <= f.first_row <= s.last_row for s in splices)]
    brief = [f for f in found if f.kind in BRIEF]
    return tuple(sorted((*splices, *broken, *brief), key=lambda f: f.first_row))


def _alone(f: Fault, step: float) -> bool:
    return len(f.channels) == 1 and step <= NEAR


def _ended(run: Run, f: Fault) -> Fault:
    """The fault until the next segment begins, which is a test of its own."""
    assert run.temperatures is not None
    later = [s.start for s in run.segments if s.start > f.first_time]
    end = int(np.searchsorted(run.temperatures.time, min(later, default=np.inf))) - 1
    last = min(f.last_row, max(end, f.first_row))
    return replace(f, last_row=last, last_time=float(run.temperatures.time[last]))


def _without(tcp: Tcp, start: float, end: float) -> Tcp:
    """TCP rows before `start` and after `end` [s]."""
    kept = (tcp.time < start) | (tcp.time > end)
    return replace(
        tcp,
        time=tcp.time[kept],
        position=tcp.position[kept],
        displacement=tcp.displacement[kept],
        sigma=tcp.sigma[kept] if tcp.sigma is not None else None,
        angle={name: values[kept] for name, values in tcp.angle.items()},
    )


def aside_words(f: Fault) -> str:
    """What was set aside, in words."""
    when = f"from {f.first_time / 3600.0:.2f} h to {f.last_time / 3600.0:.2f} h"
    lines = f"lines {f.first_row + 2} to {f.last_row + 2} of temperatures.csv"
    if f.kind == "splice":
        return f"all sensors and TCP rows {when}: rows of another time, {lines}"
    name = ", ".join(f"'{c}'" for c in f.channels)
    return f"{name} {when}, {lines}: {_DOES[f.kind]} {shown(f.size, f.unit)}"
