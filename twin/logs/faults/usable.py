"""A run without what is no measurement of its machine: a broken sensor, a leap, rows of another time.

One such channel decides a fit by least squares: it would be told as heat that nobody described. What is set aside is
told, never lost silently.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.logs.faults.fault import Fault, Kind
from twin.logs.faults.find import faults_of
from twin.logs.faults.tell import shown
from twin.logs.run import Run, Tcp

BROKEN: tuple[Kind, ...] = ("noise", "rail", "leap")  # of temperatures: what a channel shows from there on is not known


def usable(run: Run) -> tuple[Run, tuple[Fault, ...]]:
    """The run with the cells of broken temperatures emptied, all temperatures and TCP rows from a splice on as well,
    and the faults that this is for."""
    table = run.temperatures
    found = [f for f in faults_of(run) if f.table == "temperatures" and f.kind in (*BROKEN, "splice")]
    if table is None or not found:
        return run, ()
    spliced = min((f.first_row for f in found if f.kind == "splice"), default=len(table.time))
    columns = {name: values.copy() for name, values in table.columns.items()}
    kept = []
    for f in found:
        if f.first_row > spliced or (f.kind != "splice" and f.first_row >= spliced):
            continue  # of rows that are not used
        kept.append(f)
        for name in f.channels if f.kind != "splice" else columns:
            columns[name][f.first_row : (f.last_row + 1 if f.kind != "splice" else None)] = np.nan
    tcp = run.tcp
    if tcp is not None and spliced < len(table.time):
        tcp = _before(tcp, float(table.time[spliced]))
    return replace(run, temperatures=replace(table, columns=columns), tcp=tcp), tuple(kept)


def _before(tcp: Tcp, end: float) -> Tcp:
    kept = tcp.time < end
    sigma = tcp.sigma[kept] if tcp.sigma is not None else None
    angle = {name: values[kept] for name, values in tcp.angle.items()}
    return replace(
        tcp,
        time=tcp.time[kept],
        position=tcp.position[kept],
        displacement=tcp.displacement[kept],
        sigma=sigma,
        angle=angle,
    )


def aside_words(f: Fault) -> str:
    """What was set aside, in words."""
    when = f"from {f.first_time / 3600.0:.2f} h on"
    if f.kind == "splice":
        return f"all temperatures and TCP rows {when}: rows of another time, line {f.first_row + 2} of temperatures.csv"
    name = ", ".join(f"'{c}'" for c in f.channels)
    what = {"noise": "noise of", "rail": "rests at", "leap": "leaps by"}[f.kind]
    return f"{name} {when}, line {f.first_row + 2} of temperatures.csv: {what} {shown(f.size, f.unit)}"
