"""A log without what is no measurement: rows of another time, and channels that broke in some run.

A network follows its sensors for good, so a sensor that broke once is left out in all runs; what was measured before a
splice is used. Both are told.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twin.logs.faults.fault import Kind
from twin.logs.faults.find import faults_of
from twin.logs.faults.usable import aside_words
from twin.logs.run import Run, Table, Tcp

BROKEN: tuple[Kind, ...] = ("noise", "rail", "leap", "stuck")


def cleaned(runs: Sequence[Run]) -> tuple[list[Run], list[str]]:
    """The runs, and a line for everything that is not used."""
    told: list[str] = []
    broken: dict[str, str] = {}
    cut = []
    for run in runs:
        found = faults_of(run)
        splices = [f for f in found if f.kind == "splice"]
        if splices:
            first = min(splices, key=lambda f: f.first_time)
            told.append(f"{run.folder.name}: {aside_words(first)}; what comes after is not used")
            run = _until(run, first.first_time)
        last = float(run.loads.time[-1])
        for f in found:
            if f.table == "temperatures" and f.kind in BROKEN and len(f.channels) == 1 and f.first_time < last:
                broken.setdefault(f.channels[0], f"{run.folder.name}: {aside_words(f)}; the column is used in no run")
        cut.append(run)
    told += broken.values()
    return [_without(run, broken) for run in cut], told


def _until(run: Run, end: float) -> Run:
    def table(t: Table) -> Table:
        now = t.time < end
        return replace(t, time=t.time[now], columns={k: v[now] for k, v in t.columns.items()})

    tcp = run.tcp
    if tcp is not None:
        now = tcp.time < end
        sigma = None if tcp.sigma is None else tcp.sigma[now]
        tcp = Tcp(tcp.time[now], tcp.axes, tcp.position[now], tcp.displacement[now], sigma, tcp.naive,
                  {k: v[now] for k, v in tcp.angle.items()})  # fmt: skip
    return replace(
        run, loads=table(run.loads), temperatures=table(run.temperatures) if run.temperatures else None, tcp=tcp
    )


def _without(run: Run, names: Sequence[str] | dict[str, str]) -> Run:
    def table(t: Table) -> Table:
        kept = {k: v for k, v in t.columns.items() if k not in names}
        return replace(t, columns=kept, units={k: t.units[k] for k in kept})

    temperatures = table(run.temperatures) if run.temperatures is not None else None
    loads = table(run.loads)
    if not loads.columns and temperatures is not None:  # loads.csv needs a column
        name, values = next(iter(temperatures.columns.items()))
        at = np.interp(loads.time, temperatures.time, values)
        loads = replace(loads, columns={name: at}, units={name: "degC"})
    return replace(run, loads=loads, temperatures=temperatures)
