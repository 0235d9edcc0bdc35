"""A run folder in memory: what was logged, in SI. Measured and simulated runs have one shape."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Literal

import numpy as np


@dataclass(frozen=True)
class Segment:
    """A stretch of a run that is scored, or fitted, by itself: a phase, or one of several tests in one log."""

    name: str
    start: float  # s since the start of the run
    end: float  # s, after `start`


@dataclass(frozen=True)
class Table:
    """One CSV file: a common time and named columns. SI, temperatures degC; empty cells are NaN."""

    time: np.ndarray  # (n,) s since the start of the run, as logged: `check_run` tells whether it increases
    columns: Mapping[str, np.ndarray]  # (n,) each
    units: Mapping[str, str]  # SI unit of each column: "m", "m/s", "degC", "A", "1"
    naive: bool = False  # ISO times without a zone, read in the zone of run.toml


@dataclass(frozen=True)
class Tcp:
    """Measured or simulated deviations of the tool centre point; one row per measurement."""

    time: np.ndarray  # (n,) s since the start of the run
    axes: tuple[str, ...]  # names of the linear-axis columns
    position: np.ndarray  # (n, n_axes) m
    displacement: np.ndarray  # (n, 3) m, machine x, y, z
    sigma: np.ndarray | None = None  # (n,) m, standard deviation of each component
    naive: bool = False
    angle: Mapping[str, np.ndarray] = field(default_factory=dict)  # (n,) rad of each rotary axis that is logged


def tcp_places(tcp: Tcp, axes: Sequence[str], turning: Sequence[str]) -> np.ndarray:
    """Positions (n, n_axes) [m] of linear axes, behind them the angles [rad] of the axes `turning`, zero if not logged.

    Columns of angles are named like the axis, or like it with "_position". Raises ValueError for a linear axis without
    a column.
    """
    position = tcp.position[:, [tcp.axes.index(axis) for axis in axes]]
    named = {name.removesuffix("_position"): values for name, values in tcp.angle.items()}
    angles = [named.get(axis.removesuffix("_position"), np.zeros(len(tcp.time))) for axis in turning]
    return np.column_stack([position, *angles])


@dataclass(frozen=True)
class Run:
    """A run: loads, and what was measured (or simulated) meanwhile."""

    loads: Table
    temperatures: Table | None = None
    tcp: Tcp | None = None
    start: datetime | None = None  # with a zone; time zero of every table. None where unknown
    zone: str | None = None  # IANA name, "Europe/Berlin"
    sampling: float | None = None  # s, of the loads, as stated
    provenance: str = ""
    synthetic: tuple[str, ...] = ()  # the tables that were computed, not measured: "loads", "temperatures", "tcp"
    initial_temperature: float | None = None  # degC of the whole machine at the start, where known
    steady_start: bool = False  # it starts in equilibrium with its surroundings instead, after a rest
    machine: str | None = None  # path of the machine description, relative to the run folder
    folder: Path = field(default=Path("."))
    segments: tuple[Segment, ...] = ()  # in the order of time, without overlap
    tcp_reference: Literal["absolute", "first"] = "absolute"  # "first": tcp.csv counts deviations from its first row
