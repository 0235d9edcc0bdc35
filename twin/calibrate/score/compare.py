"""What a run measured beside what a replay of it computed: one `Channel` per sensor and per axis of the TCP error.

Nothing is resampled that was measured: computed values are brought to the times and positions of the measurements.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from twin.errors import LogError
from twin.logs.run import Run, Tcp, tcp_places
from twin.rom.artefact import Artefact
from twin.rom.tcp import by_body, tcp_at
from twin.run.results import Result

TCP = ("dx", "dy", "dz")


@dataclass(frozen=True)
class Channel:
    """One output of one run: measured beside simulated, at the n measurements that can be compared."""

    name: str  # sensor name, or "dx", "dy", "dz"
    kind: str  # "temperature" or "tcp"
    unit: str  # "degC" or "m"
    time: np.ndarray  # (n,) s, of the measurements that are finite and inside the simulated span
    measured: np.ndarray  # (n,)
    simulated: np.ndarray  # (n,)
    sigma: np.ndarray | None = None  # (n,) standard deviation of each measurement where known
    position: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))  # (n, n_axes) m, of TCP measurements
    row: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))  # (n,) of temperatures.csv or tcp.csv


@dataclass(frozen=True)
class LeftOut:
    """What `channels` could not compare, for reports."""

    unknown: tuple[str, ...]  # sensors of the run that the machine lacks
    unmeasured: tuple[str, ...]  # sensors of the machine that the run lacks
    temperature_rows: int  # rows of temperatures.csv outside the simulated time
    tcp_rows: int  # rows of tcp.csv outside it
    tcp_incomplete: int  # rows of tcp.csv inside it without a position or without any deviation
    tcp_outside_grid: int  # rows of tcp.csv beyond the poses: where the certificate does not reach


def channels(artefact: Artefact, run: Run, result: Result) -> tuple[Channel, ...]:
    """Temperatures [degC] in the order of the run's columns, then dx, dy, dz [m] of a machine whose TCP moves; a
    channel without any value is left out.

    Temperatures are interpolated linearly in time; TCP errors too, at the measured positions (`twin.rom.tcp`). An axis
    without a column in tcp.csv stands where the loads say. Where `run.tcp_reference` is "first", deviations count from
    the first row of tcp.csv, so the computed error at that row is subtracted and the row itself is no comparison.
    `left_out` tells what is not among the channels.

    Raises LogError where the first row is the reference and has no computed value.
    """
    found = []
    if run.temperatures is not None:
        time, columns = run.temperatures.time, run.temperatures.columns
        inside = _inside(time, result)
        for name, measured in columns.items():
            if name not in result.sensors:
                continue
            rows = inside & np.isfinite(measured)
            simulated = np.interp(time[rows], result.time, result.temperature[:, result.sensors.index(name)])
            found.append(
                Channel(name, "temperature", "degC", time[rows], measured[rows], simulated, row=np.flatnonzero(rows))
            )
    if run.tcp is not None and len(run.tcp.time) and artefact.model.moves:
        tcp = run.tcp
        position = tcp_positions(tcp, result)
        usable = _inside(tcp.time, result) & np.isfinite(position).all(axis=1)
        simulated = simulated_tcp(artefact, result, tcp.time, position)
        if run.tcp_reference == "first":
            if not usable[0]:
                raise LogError(
                    "deviations count from the first row, which is outside the simulated time or has no position",
                    str(run.folder / "tcp.csv"),
                    "let the loads begin before the first row, or remove rows before the loads",
                )
            simulated = simulated - simulated[0]
            usable[0] = False
        for axis, name in enumerate(TCP):
            rows = usable & np.isfinite(tcp.displacement[:, axis])
            sigma = None if tcp.sigma is None else tcp.sigma[rows]
            values = (tcp.time[rows], tcp.displacement[rows, axis], simulated[rows, axis])
            found.append(Channel(name, "tcp", "m", *values, sigma, position[rows], np.flatnonzero(rows)))
    return tuple(channel for channel in found if len(channel.time))


def left_out(run: Run, result: Result) -> LeftOut:
    """Names and numbers of rows that `channels` leaves out."""
    measured = () if run.temperatures is None else tuple(run.temperatures.columns)
    outside = 0 if run.temperatures is None else int((~_inside(run.temperatures.time, result)).sum())
    rows, incomplete, beyond = 0, 0, 0
    if run.tcp is not None:
        position, inside = tcp_positions(run.tcp, result), _inside(run.tcp.time, result)
        complete = np.isfinite(position).all(axis=1) & np.isfinite(run.tcp.displacement).any(axis=1)
        rows, incomplete = int((~inside).sum()), int((inside & ~complete).sum())
        beyond = int((inside & complete & _beyond(position, result)).sum())
    return LeftOut(
        unknown=tuple(name for name in measured if name not in result.sensors),
        unmeasured=tuple(name for name in result.sensors if name not in measured),
        temperature_rows=outside,
        tcp_rows=rows,
        tcp_incomplete=incomplete,
        tcp_outside_grid=beyond,
    )


def tcp_positions(tcp: Tcp, result: Result) -> np.ndarray:
    """(n, n_pose_axes) m at the rows of tcp.csv, behind them the angles [rad] of axes that turn.

    Raises LogError for an axis without a column: loads tell too coarsely where a moving axis stood.
    """
    missing = [a for a in result.pose_axes if a not in tcp.axes]
    if missing:
        remedy = "give the position of every linear axis in a column of its name"
        raise LogError(f"no position of {', '.join(missing)}", "tcp.csv", remedy)
    return tcp_places(tcp, result.pose_axes, result.turning)


def simulated_tcp(artefact: Artefact, result: Result, time: np.ndarray, position: np.ndarray) -> np.ndarray:
    """TCP error (n, 3) m at times (n,) s and positions (n, n_pose_axes) m; NaN outside the simulated time.

    `result` is a replay of this artefact: states are interpolated linearly in time, and the artefact says what they do
    to the tool at each position.
    """
    inside = _inside(time, result) & np.isfinite(position).all(axis=1)
    values = np.full((len(time), 3), np.nan)
    if not inside.any():
        return values
    at = np.clip(np.searchsorted(result.time, time[inside], side="right") - 1, 0, max(len(result.time) - 2, 0))
    after = np.minimum(at + 1, len(result.time) - 1)
    length = result.time[after] - result.time[at]
    share = np.where(length > 0.0, (time[inside] - result.time[at]) / np.where(length > 0.0, length, 1.0), 0.0)
    states = result.states[at] + share[:, None] * (result.states[after] - result.states[at])
    values[inside] = tcp_at(artefact.model, by_body(artefact.model, states), position[inside])
    return values


def _inside(time: np.ndarray, result: Result) -> np.ndarray:
    return np.isfinite(time) & (time >= result.time[0]) & (time <= result.time[-1])


def _beyond(position: np.ndarray, result: Result) -> np.ndarray:
    """(n,) bool: beyond the range of the poses along any axis; not a number is not beyond."""
    position = position[:, : len(result.pose_axes)]
    if not position.shape[1]:
        return np.zeros(len(position), dtype=bool)
    low, high = result.poses.min(axis=0), result.poses.max(axis=0)
    margin = 1e-9 * np.maximum(np.abs(low), np.abs(high))
    return ((position < low - margin) | (position > high + margin)).any(axis=1)
