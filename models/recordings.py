"""Real recordings as runs, where the measured data are at hand: days of a lathe, and hours of a spindle."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from models.measured import measured_data
from twin.logs.run import Run, Table, Tcp

_PROBES = {"Disp. X": 0, "Disp. Z": 2}  # of the lathe: component
_CHANNELS = {"ch1": 0, "ch3": 1, "ch5": 2}  # of the spindle


def lathe_days() -> list[Path]:
    """The files of the lathe in the order of their dates, one a day; empty where there are none."""
    folder = measured_data("lathe")
    return sorted(folder.glob("*.csv")) if folder is not None else []


def lathe_run(path: Path) -> Run:
    """A day of the lathe: 21 temperatures of the machine and three of its motors, X and Z displacement. No loads."""
    names, values = _read(path)
    time, columns = 60.0 * values[:, 0], dict(zip(names[1:], values[:, 1:].T, strict=True))
    temperatures = {n: v for n, v in columns.items() if n not in _PROBES}
    return Run(
        loads=Table(time, {}, {}),
        temperatures=Table(time, temperatures, dict.fromkeys(temperatures, "degC")),
        tcp=_tcp(time, {k: columns[n] for n, k in _PROBES.items()}),
        provenance=path.stem,
        folder=path.parent,
    )


def spindle_run(first: float, last: float) -> Run | None:
    """Hours first .. last of the spindle: its speed, 16 temperatures, three displacements. None without the data."""
    folder = measured_data("spindle_drift")
    if folder is None:
        return None
    tables = []
    for name in ("loads", "temperatures", "displacement"):
        names, values = _read(folder / "warmup" / f"{name}.csv")
        values = values[(values[:, 0] >= 3600.0 * first) & (values[:, 0] < 3600.0 * last)]
        tables.append((values[:, 0] - 3600.0 * first, dict(zip(names[1:], values[:, 1:].T, strict=True))))
    (time, loads), (_, temperatures), (_, probes) = tables
    return Run(
        loads=Table(time, {n: v / 60.0 for n, v in loads.items()}, dict.fromkeys(loads, "1/s")),
        temperatures=Table(time, temperatures, dict.fromkeys(temperatures, "degC")),
        tcp=_tcp(time, {k: probes[n] for n, k in _CHANNELS.items()}),
        folder=folder / "warmup",
    )


def _tcp(time: np.ndarray, components: dict[int, np.ndarray]) -> Tcp:
    """um given; a component that was not measured is missing."""
    displacement = np.full((len(time), 3), np.nan)
    for k, values in components.items():
        displacement[:, k] = 1e-6 * values
    return Tcp(time, (), np.zeros((len(time), 0)), displacement)


def _read(path: Path) -> tuple[list[str], np.ndarray]:
    """Names without units, and values (n_rows, n_columns)."""
    with path.open(encoding="utf-8") as file:
        names = [cell.split(" [")[0] for cell in file.readline().strip().split(",")]
        return names, np.loadtxt(file, delimiter=",")
