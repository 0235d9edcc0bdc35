"""Faults of the measured displacement: devices, play, and what moves the tool without heat."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from twin.errors import LogError
from twin.inject.damage.channels import (
    Damage,
    acts,
    column_at,
    component,
    component_and_axis,
    grown,
    set_of,
    tcp_time,
    with_tcp,
)  # fmt: skip
from twin.logs.run import Run
from twin.physics.play import play


def step(run: Run, d: Damage) -> Run:
    """A displacement that comes at the start of the fault and goes at its end."""
    time = tcp_time(run)
    return with_tcp(run, d, acts(time, d).astype(float))


def slip(run: Run, d: Damage) -> Run:
    """A support with play: the tool stays behind until the displacement has moved on by the size.

    The play is that of the mean of every measurement: its rows differ by their positions, not by what the machine did.
    """
    time, c = tcp_time(run), component(d.place)
    assert run.tcp is not None
    group = set_of(time)
    level = np.bincount(group, run.tcp.displacement[:, c]) / np.bincount(group)
    known = np.isfinite(level)
    behind = np.zeros(len(level))
    behind[known] = play(level[known], abs(d.size)) - level[known]
    return with_tcp(run, replace(d, size=1.0), behind[group] * acts(time, d))


def drift(run: Run, d: Damage) -> Run:
    """The measuring device drifts linearly."""
    return with_tcp(run, d, grown(tcp_time(run), d))


def rezero(run: Run, d: Damage) -> Run:
    """The measuring device is set to the size at the start of the fault, and counts from there."""
    time, c = tcp_time(run), component(d.place)
    assert run.tcp is not None
    during = acts(time, d) & np.isfinite(run.tcp.displacement[:, c])
    lost = d.size - run.tcp.displacement[np.argmax(during), c] if during.any() else 0.0
    return with_tcp(run, replace(d, size=1.0), lost * acts(time, d))


def stuck(run: Run, d: Damage) -> Run:
    """The measuring device keeps, for the size [s], what it shows at the start of the fault."""
    time, c = tcp_time(run), component(d.place)
    assert run.tcp is not None
    shows = run.tcp.displacement[:, c]
    first = time[0] if d.start == -math.inf else d.start
    kept = (time >= first) & (time < min(first + d.size, d.end)) & np.isfinite(shows)
    lost = np.where(kept, shows[np.argmax(kept)] - shows, 0.0)
    return with_tcp(run, replace(d, size=1.0), lost)


def heating(run: Run, d: Damage) -> Run:
    """Measuring heats the machine: the size more from the first to the last row of every measurement."""
    time = tcp_time(run)
    group = set_of(time)
    row, rows = np.arange(len(time)) - np.searchsorted(group, group), np.bincount(group)[group]
    if rows.max() == 1:
        remedy = "take a run that measures several places one after the other, less than 10 min apart"
        raise LogError("every measurement is one row", str(run.folder / "tcp.csv"), remedy)
    return with_tcp(run, d, row / np.maximum(rows - 1, 1) * acts(time, d))


def frame(run: Run, d: Damage) -> Run:
    """The measuring frame stands askew by the size [m/m]: a component reads more in proportion to an axis position."""
    time = tcp_time(run)
    place, position = component_and_axis(run, d.place)
    if np.ptp(position) < 1e-6:
        remedy = "take a run that measures the TCP at several positions, or name another axis"
        raise LogError(f"the axis of '{d.place}' stands still", str(run.folder / "tcp.csv"), remedy)
    return with_tcp(run, replace(d, place=place), position * acts(time, d))


def load(run: Run, d: Damage) -> Run:
    """A displacement by force or weight: the size where a column of the loads is largest, and in proportion below."""
    time = tcp_time(run)
    values = np.abs(column_at(run, d.signal, time))
    top = float(np.nanmax(np.abs(run.loads.columns[d.signal]))) if d.signal in run.loads.columns else 0.0
    if not top > 0.0:
        raise LogError(f"column '{d.signal}' of loads.csv is zero or missing", "--signal", "name one that varies")
    return with_tcp(run, d, np.nan_to_num(values / top) * acts(time, d))
