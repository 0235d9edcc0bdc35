"""What was measured in a run, as a fit compares it: temperatures averaged over bins, TCP rows one by one.

A sensor is logged far more often than a machine tool changes: means over bins lose nothing and make the noise of a bin
sigma / sqrt(samples). Sensors in the air are inputs of the model, not outputs, and are left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.errors import LogError
from twin.logs.faults.usable import aside_words, usable
from twin.logs.run import Run, Table, tcp_places
from twin.logs.signals import read_from_temperatures
from twin.rom.drive import Drive
from twin.rom.model import MachineModel
from twin.rom.poses import Kind, outside_grid
from twin.rom.tcp import row_weights

BIN = 300.0  # s
LEAST = 0.5  # share of a bin's samples that a sensor must have


@dataclass(frozen=True)
class Measured:
    """One run; s sensors, b bins, k TCP rows."""

    name: str
    sensors: tuple[str, ...]  # in the order of columns below
    column: np.ndarray  # (s,) index among the model's sensors
    bin_time: np.ndarray  # (b,) s
    mean_of: np.ndarray  # (b, n_steps + 1): bin means = mean_of @ outputs at step edges
    temperature: np.ndarray  # (b, s) degC, NaN where too few samples
    count: np.ndarray  # (b, s) samples
    tcp_time: np.ndarray  # (k,) s
    tcp_step: np.ndarray  # (k,) int, step edge before
    tcp_share: np.ndarray  # (k,) of the edge after
    pose: np.ndarray  # (k, n_poses) weights of the poses
    tcp: np.ndarray  # (k, 3) m, NaN along axes that the run does not measure
    tcp_sigma: np.ndarray | None  # (k,) m, where the run tells
    from_first: bool  # deviations count from the first row
    skipped: tuple[str, ...]  # what the run holds and the fit does not use, in words
    position: np.ndarray  # (k, n_pose_axes) m of the TCP rows, angles [rad] of axes that turn behind them

    def row_weight(self, sigma: float) -> np.ndarray:
        """(k,) how much better than `sigma` [m] each TCP row is measured; 1 where the run does not tell."""
        if self.tcp_sigma is None:
            return np.ones(len(self.tcp))
        told = np.isfinite(self.tcp_sigma) & (self.tcp_sigma > 0.0)
        return np.where(told, sigma / np.where(told, self.tcp_sigma, 1.0), 1.0)

    @property
    def n_temperature(self) -> int:
        return int(np.isfinite(self.temperature).sum())


def tcp_positions(model: MachineModel, runs: Sequence[Run]) -> np.ndarray:
    """(m, n_pose_axes) m: where the runs measured the TCP displacement, within the poses of the model's grid.

    With the angles [rad] of rotary axes that turn behind them (`twin.rom.tcp`).
    """
    found = [np.zeros((0, len(model.pose_axes) + len(model.turning)))]
    for run in runs:
        if run.tcp is not None and set(model.pose_axes) <= set(run.tcp.axes):
            position = tcp_places(run.tcp, model.pose_axes, model.turning)
            position = position[np.isfinite(position).all(axis=1)]
            found.append(position[~outside_grid(model.pose_grid, position[:, : len(model.pose_axes)])])
    return np.concatenate(found)


def measured(
    model: MachineModel,
    run: Run,
    drive: Drive,
    name: str,
    bin_length: float = BIN,
    exclude: Sequence[str] = (),
    interpolation: Kind = "lagrange",
) -> Measured:
    """The measurements of a run beside a drive of it. exclude: sensors left out.

    What `twin.logs.faults.usable` sets aside is missing. Raises LogError where a run holds nothing that the model
    predicts.
    """
    run, aside = usable(run, [s for s in model.sensors if s not in exclude])
    skipped = [f"set aside: {aside_words(f)}" for f in aside]
    edges = drive.time
    table, read = run.temperatures, read_from_temperatures(run, model.load_model.signals)
    sensors = [s for s in model.sensors if table is not None and s in table.columns and s not in exclude]
    if table is not None:
        centre, mean_of, temperature, count = _temperatures(model, table, sensors, read, edges, bin_length, skipped)
    else:
        centre, mean_of = np.zeros(0), np.zeros((0, len(edges)))
        temperature = count = np.zeros((0, 0))
    step, share, pose, tcp, sigma, when, position = _tcp_rows(model, run, edges, interpolation, skipped)
    if run.tcp_reference == "first" and len(tcp):
        tcp = tcp - tcp[0]  # from the first row that is used, as the model's
    if not np.isfinite(temperature).any() and not len(tcp):
        raise LogError(
            "nothing measured that the model predicts", str(run.folder),
            "a fit needs temperatures.csv with sensors of the machine, tcp.csv, or both",
        )  # fmt: skip
    return Measured(
        name=name,
        sensors=tuple(sensors),
        column=np.array([model.sensors.index(s) for s in sensors], dtype=int),
        bin_time=centre,
        mean_of=mean_of,
        temperature=temperature,
        count=count,
        tcp_time=when,
        tcp_step=step,
        tcp_share=share,
        pose=pose,
        tcp=tcp,
        tcp_sigma=sigma,
        from_first=run.tcp_reference == "first" and len(tcp) > 0,
        skipped=tuple(skipped),
        position=position,
    )


def after_steps(measured: Measured, steps: int) -> Measured:
    """The same of a drive with so many steps in front of the one that it was read beside."""
    before = np.zeros((len(measured.mean_of), steps))
    return replace(measured, mean_of=np.hstack([before, measured.mean_of]), tcp_step=measured.tcp_step + steps)


def _temperatures(
    model: MachineModel, table: Table, sensors: list[str], read: set[str], edges: np.ndarray, bin_length: float,
    skipped: list[str],
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """What `_bins` makes of the sensors' columns; read: columns that signals are read from. What is left out is added
    to `skipped`."""
    known = {*model.sensors, *(name for name, _ in model.ambient_sensors), *read}
    if unknown := [c for c in table.columns if c not in known]:
        what = "1 column that is" if len(unknown) == 1 else f"{len(unknown)} columns that are"
        skipped.append(f"{what} no sensor of the machine: {', '.join(unknown)}")
    time = table.time
    inside = (time >= edges[0]) & (time <= edges[-1])
    if not inside.all():
        skipped.append(f"{int((~inside).sum())} rows of temperatures outside the loads' time")
    values = np.column_stack([table.columns[s] for s in sensors]) if sensors else np.zeros((len(time), 0))
    centre, mean_of, temperature, count = _bins(edges, time[inside], values[inside], bin_length)
    lost = int((~np.isfinite(temperature) & (count > 0)).sum())
    if lost:
        skipped.append(
            f"{lost} of {temperature.size} means of temperatures over a bin are not used: too few samples in it, or "
            "all to one side"
        )
    return centre, mean_of, temperature, count


def _bins(
    edges: np.ndarray, time: np.ndarray, values: np.ndarray, length: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    if not len(time):
        none = np.zeros((0, values.shape[1]))
        return np.zeros(0), np.zeros((0, len(edges))), none, none
    number = np.floor((time - edges[0]) / length).astype(int)
    used = np.arange(number.min(), number.max() + 1)  # bins of a gap stay, empty: it interrupts the noise model
    row = number - used[0]
    position = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, len(edges) - 2)
    share = (time - edges[position]) / (edges[position + 1] - edges[position])
    size = np.bincount(row, minlength=len(used)).astype(float)
    mean_of = np.zeros((len(used), len(edges)))
    np.add.at(mean_of, (row, position), (1.0 - share) / size[row])
    np.add.at(mean_of, (row, position + 1), share / size[row])
    good = np.isfinite(values)
    total, count = np.zeros((2, len(used), values.shape[1]))
    np.add.at(total, row, np.where(good, values, 0.0))
    np.add.at(count, row, good.astype(float))
    own = np.zeros_like(total)
    np.add.at(own, row, np.where(good, time[:, None], 0.0))
    centre = np.bincount(row, time, minlength=len(used)) / np.maximum(size, 1.0)
    usual = np.median(size[size > 0])
    enough = (count >= LEAST * np.maximum(size, usual)[:, None]) & (
        np.abs(own / np.maximum(count, 1.0) - centre[:, None]) <= 0.05 * length
    )
    mean = np.where(enough, total / np.maximum(count, 1.0), np.nan)
    return edges[0] + (used + 0.5) * length, mean_of, mean, count


def _tcp_rows(
    model: MachineModel, run: Run, edges: np.ndarray, interpolation: Kind, skipped: list[str]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray | None, np.ndarray, np.ndarray]:
    tcp = run.tcp
    if tcp is None:
        none, weights, positions = np.zeros(0), np.zeros((0, len(model.poses))), tcp_positions(model, [])
        return none.astype(int), none, weights, np.zeros((0, 3)), None, none, positions
    missing = [a for a in model.pose_axes if a not in tcp.axes]
    if missing:
        raise LogError(
            f"no position of {', '.join(missing)}", str(run.folder / "tcp.csv"),
            "give the position of every linear axis in a column of its name",
        )  # fmt: skip
    position = tcp_places(tcp, model.pose_axes, model.turning)
    known = np.isfinite(tcp.displacement)
    whole = known[:, known.any(axis=0)].all(axis=1) & known.any(axis=1) & np.isfinite(position).all(axis=1)
    good = (tcp.time >= edges[0]) & (tcp.time <= edges[-1]) & whole
    if not good.all():
        skipped.append(f"{int((~good).sum())} rows of tcp.csv outside the loads' time, or with an empty cell")
    position = position[good]
    weights, outside = row_weights(model, position, interpolation)
    if outside.any():
        skipped.append(f"{int(outside.sum())} rows of tcp.csv outside the pose grid")
    inside = ~outside
    time = tcp.time[good][inside]
    step = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, len(edges) - 2)
    share = (time - edges[step]) / (edges[step + 1] - edges[step])
    sigma = None if tcp.sigma is None else tcp.sigma[good][inside]
    return step, share, weights[inside], tcp.displacement[good][inside], sigma, time, position[inside]
