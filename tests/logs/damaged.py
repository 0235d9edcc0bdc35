"""A sound log with known numbers, and the ways in which logs get damaged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from twin.logs.run import Run

STEP, ROWS = 5.0, 320
START = datetime.fromisoformat("2026-10-24T22:00:00+02:00")
RUN_TOML = "start = 2026-10-24T22:00:00+02:00\nzone = 'Europe/Berlin'\nsampling = '5 s'\n"


@dataclass(frozen=True)
class Signal:
    name: str
    column: str
    unit: str
    low: float
    high: float
    kind: str = "value"
    default: float | None = None
    factor: float = 1.0


SIGNALS = (
    Signal("x_position", "x_position", "m", -0.2, 0.2),
    Signal("x_speed", "x_speed", "m/s", -0.02, 0.02),
    Signal("x_motor_speed", "x_motor_speed", "1/s", -2.0, 2.0),
    Signal("x_current", "x_current", "A", 0.0, 12.0, "rms"),
    Signal("spindle_speed", "spindle_speed", "1/s", 0.0, 100.0),
    Signal("spindle_power", "spindle_power", "W", 0.0, 5000.0),
    Signal("ambient", "ambient", "degC", 12.0, 32.0),
)
SENSORS = ("front", "motor", "bed", "shop")
STROKES = {"x": (-0.2, 0.2)}


@dataclass(frozen=True)
class Log:
    """Three tables as cells of text, the header first, and how they are written."""

    loads: list[list[str]]
    temperatures: list[list[str]]
    tcp: list[list[str]]
    delimiter: str = ","
    run: str = RUN_TOML

    def table(self, name: str) -> list[list[str]]:
        rows: list[list[str]] = getattr(self, name)
        return rows

    def files(self) -> dict[str, bytes]:
        files = {"run.toml": self.run.encode()}
        for name in ("loads", "temperatures", "tcp"):
            lines = [self.delimiter.join(row) for row in self.table(name)]
            files[f"{name}.csv"] = ("\n".join(lines) + "\n").encode()
        return files


def write(folder: Path, files: dict[str, bytes]) -> Path:
    folder.mkdir(exist_ok=True)
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return folder


def sound(rng: np.random.Generator) -> Log:
    """An axis that swings and rests, a spindle that turns at random speeds, four temperatures that answer exactly as
    first-order lags do, R-tests; noise as sensors have it, and numbers rounded as a logger rounds them."""
    t = np.arange(ROWS) * STEP
    swings = (np.arange(ROWS) // 80) % 4 != 3
    phase = 2.0 * np.pi * np.cumsum(swings) * STEP / rng.uniform(100.0, 140.0)
    x = 150.0 * np.sin(phase)  # mm
    v = np.where(swings, np.gradient(x, STEP), 0.0) * 0.06  # m/min
    n = np.repeat(rng.choice([0.0, 1500.0, 3000.0, 4500.0], ROWS // 16), 16)  # 1/min
    n[:32] = 0.0
    power = np.where(n > 0.0, 0.3 + n / 2000.0 + 0.03 * rng.standard_normal(ROWS), 0.0)  # kW
    current = 1.5 + 8.0 * np.abs(v) + 0.05 * rng.standard_normal(ROWS)
    ambient = 21.0 + 0.8 * np.sin(2.0 * np.pi * t / 4000.0)
    heat = np.column_stack([power, current**2 / 20.0])
    temperatures = []
    for own, tau in (((2.0, 0.1), 25.0), ((0.2, 2.0), 60.0), ((0.4, 0.3), 600.0), ((0.0, 0.0), 400.0)):
        T, keep = [float(ambient[0])], np.exp(-STEP / tau)
        for k in range(ROWS - 1):
            T.append(keep * T[-1] + (1.0 - keep) * (ambient[k] + 3.0 * float(heat[k] @ np.array(own))))
        temperatures.append(np.array(T) + 0.005 * rng.standard_normal(ROWS))
    loads = [
        ["time [s]", "x_position [mm]", "x_speed [m/min]", "x_motor_speed [1/min]", "x_current [A]",
         "spindle_speed [1/min]", "spindle_power [kW]", "ambient [degC]"],
        *(
            [f"{t[k]:.0f}", f"{x[k]:.3f}", f"{v[k]:.4f}", f"{v[k] / 0.01:.2f}", f"{current[k]:.3f}", f"{n[k]:.0f}",
             f"{power[k]:.4f}", f"{ambient[k] + 0.02 * rng.standard_normal():.3f}"]
            for k in range(ROWS)
        ),
    ]  # fmt: skip
    tcp = [["time [s]", "x [mm]", "dx [um]", "dy [um]", "dz [um]"]]
    for k in range(20, ROWS, 25):
        d = [0.4 * k / 10.0, -0.2 * k / 10.0, 0.7 * k / 10.0]
        tcp.append([f"{t[k]:.0f}", f"{x[k]:.3f}", *(f"{v + 0.2 * rng.standard_normal():.3f}" for v in d)])
    shown = [["time [s]", *(f"{name} [degC]" for name in SENSORS)]]
    shown += [[f"{t[k]:.0f}", *(f"{T[k]:.3f}" for T in temperatures)] for k in range(ROWS)]
    return Log(loads, shown, tcp)


def iso(log: Log, zone: str) -> Log:
    """The same with ISO times: "offset", "utc" or "naive" (local times of Berlin)."""

    def cell(seconds: str) -> str:
        moment = START + timedelta(seconds=float(seconds))
        if zone == "utc":
            return (moment - timedelta(hours=2)).replace(tzinfo=None).isoformat() + "Z"
        return moment.isoformat() if zone == "offset" else moment.replace(tzinfo=None).isoformat()

    def table(rows: list[list[str]]) -> list[list[str]]:
        return [["time", *rows[0][1:]], *([cell(row[0]), *row[1:]] for row in rows[1:])]

    return replace(log, loads=table(log.loads), temperatures=table(log.temperatures), tcp=table(log.tcp))


def german(log: Log, delimiter: str = ";") -> Log:
    """The same with decimal commas."""

    def table(rows: list[list[str]]) -> list[list[str]]:
        return [rows[0], *([cell.replace(".", ",") for cell in row] for row in rows[1:])]

    return replace(
        log, loads=table(log.loads), temperatures=table(log.temperatures), tcp=table(log.tcp), delimiter=delimiter
    )


def change(log: Log, name: str, edit: Callable[[list[list[str]]], list[list[str]]]) -> Log:
    """The log with the rows of one table edited; header included."""
    return replace(log, **{name: edit([list(row) for row in log.table(name)])})


def column(log: Log, name: str, header: str, edit: Callable[[np.ndarray], np.ndarray]) -> Log:
    """The log with the numbers of one column edited."""

    def rows_of(rows: list[list[str]]) -> list[list[str]]:
        k = next(i for i, cell in enumerate(rows[0]) if cell.split(" [")[0] == header)
        values = edit(np.array([float(row[k]) for row in rows[1:]]))
        for row, value in zip(rows[1:], values, strict=True):
            row[k] = f"{value:.6g}"
        return rows

    return change(log, name, rows_of)


def differences(run: Run, truth: Run) -> dict[tuple[str, str], np.ndarray]:
    """(table, column) -> rows that differ, or all of -1 where the column is lost or of another length."""
    found: dict[tuple[str, str], np.ndarray] = {}

    def compare(table: str, name: str, a: np.ndarray | None, b: np.ndarray) -> None:
        if a is None or len(a) != len(b):
            found[table, name] = np.full(len(b), -1)
        elif (rows := np.flatnonzero(~((a == b) | (np.isnan(a) & np.isnan(b))))).size:
            found[table, name] = rows

    for name in ("loads", "temperatures"):
        ours, theirs = getattr(run, name), getattr(truth, name)
        compare(name, "time", ours.time if ours else None, theirs.time)
        for c, values in theirs.columns.items():
            compare(name, c, ours.columns.get(c) if ours else None, values)
    if run.tcp is None or run.tcp.axes != truth.tcp.axes:
        found["tcp", "axes"] = np.full(len(truth.tcp.time), -1)
    else:
        compare("tcp", "time", run.tcp.time, truth.tcp.time)
        compare("tcp", "x", run.tcp.position[:, 0], truth.tcp.position[:, 0])
        for k, d in enumerate(("dx", "dy", "dz")):
            compare("tcp", d, run.tcp.displacement[:, k], truth.tcp.displacement[:, k])
    return found
