"""Warm-up: when a machine has settled, how it drifts at the end of a run, and how fast it got there.

For a value y(t), t from 0 to the end of the run, d(t) = |y(t) - y(end)| is its distance from the final value, and the
change is the largest distance. For a value that moves one way this is |y(end) - y(0)|; one that comes back counts too.

- time: from here on d stays within the tolerance. Zero where it never left it.
- settled: in the time `horizon` after the end the value would drift by less than the tolerance, at the rate at which
  the run ended. Where it is not settled the final value is only where the run was stopped: the time is not reached.
- t63, t95: from here on d stays within 1/e (36.8 %), within 5 % of the change. For y = 1 - exp(-t/tau) and a long run
  they are tau and 3.0 tau. Of a machine that has not settled they describe the run, not the machine.
- rate: slope of the line of least squares through the last `window` of the run.

Between samples values run linearly. Paper 002 (section 3.2) runs the part program "until thermal equilibrium is finally
reached" without saying what that is; these are our definitions.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from twin.errors import TwinError
from twin.rom.hdf5_file import strings
from twin.run.results import FORMAT
from twin.together import open_result

WINDOW = 600.0  # s
HORIZON = 3600.0  # s
SHARE_63, SHARE_95 = float(np.exp(-1.0)), 0.05  # of the change that is left at t63 and t95


@dataclass(frozen=True)
class Settling:
    """How one value settles; SI, K for temperatures, times from the start of the run."""

    change: float  # largest distance from the final value
    final: float  # value at the end minus value at the start
    rate: float  # 1/s, at the end
    settled: bool
    time: float | None  # s; None: not reached
    t63: float  # s
    t95: float  # s


@dataclass(frozen=True)
class WarmUp:
    """What `twin warmup` tells."""

    duration: float  # s
    window: float  # s over which the rates are taken: WINDOW, or a third of a shorter run
    actual: dict[str, Settling]  # TCP error at the actual position, by component
    worst: dict[str, tuple[int, Settling]]  # at the pose where the component changes most, and that pose
    sensors: dict[str, Settling]

    @property
    def settled(self) -> bool:
        """Whether the TCP error has settled at every component's worst pose."""
        return all(s.settled for _, s in self.worst.values())

    @property
    def time(self) -> float | None:
        """When the last of them has, [s]; None if one has not."""
        times = [s.time for _, s in self.worst.values()]
        return None if any(t is None for t in times) else max((t for t in times if t is not None), default=0.0)


@dataclass(frozen=True)
class History:
    """The part of a result that warms up; n + 1 step edges."""

    time: np.ndarray  # (n + 1,) s since the start of the run
    sensors: tuple[str, ...]
    temperature: np.ndarray  # (n + 1, n_sensors) degC
    pose_axes: tuple[str, ...]
    poses: np.ndarray  # (n_poses, n_pose_axes) m
    tcp: np.ndarray  # (n + 1, n_poses, 3) m
    tcp_actual: np.ndarray  # (n + 1, 3) m


def last_entry(time: np.ndarray, distance: np.ndarray, band: float) -> float:
    """From when on a distance (n,) stays within `band` [s], linear between samples; zero where it never leaves it.

    time (n,) s, increasing. The distance must end inside the band, as a distance from the final value does.
    """
    outside = np.flatnonzero(distance > band)
    if not len(outside):
        return float(time[0])
    k = int(outside[-1])
    share = (distance[k] - band) / (distance[k] - distance[k + 1])
    return float(time[k] + share * (time[k + 1] - time[k]))


def end_rate(time: np.ndarray, value: np.ndarray, window: float) -> float:
    """Slope [1/s] of the line of least squares through the samples of the last `window` [s], at least two.

    time (n,) s, value (n,), n >= 2.
    """
    last = max(2, int(np.sum(time >= time[-1] - window * (1.0 + 1e-9))))
    t = time[-last:] - time[-last:].mean()
    return float(t @ (value[-last:] - value[-last:].mean()) / (t @ t))


def settling(
    time: np.ndarray, value: np.ndarray, tolerance: float, window: float = WINDOW, horizon: float = HORIZON
) -> Settling:
    """How `value` (n,) over `time` (n,) [s] settles; the terms are defined at the head of this file.

    tolerance > 0 in the unit of the value. Raises ValueError for less than two samples.
    """
    if len(time) < 2:
        raise ValueError("a warm-up needs two samples")
    elapsed = time - time[0]
    distance = np.abs(value - value[-1])
    change = float(distance.max())
    rate = end_rate(elapsed, value, window)
    settled = abs(rate) * horizon <= tolerance and bool(distance[-2] <= tolerance)
    return Settling(
        change=change,
        final=float(value[-1] - value[0]),
        rate=rate,
        settled=settled,
        time=last_entry(elapsed, distance, tolerance) if settled else None,
        t63=last_entry(elapsed, distance, SHARE_63 * change),
        t95=last_entry(elapsed, distance, SHARE_95 * change),
    )


def warm_up(
    history: History, tolerance: float, temperature_tolerance: float, horizon: float = HORIZON, window: float = WINDOW
) -> WarmUp:
    """The warm-up of every TCP component and sensor; of no component where the TCP never moves.

    tolerance [m], temperature_tolerance [K], horizon and window [s]. Raises ValueError for less than two samples.
    """
    time = history.time
    duration = float(time[-1] - time[0])
    window = min(window, duration / 3.0)

    def of(values: np.ndarray, band: float) -> Settling:
        return settling(time, values, band, window, horizon)

    moving = "xyz" if history.tcp.any() else ""
    change = np.abs(history.tcp - history.tcp[-1]).max(axis=0)  # (n_poses, 3)
    worst = change.argmax(axis=0)
    return WarmUp(
        duration=duration,
        window=window,
        actual={name: of(history.tcp_actual[:, c], tolerance) for c, name in enumerate(moving)},
        worst={name: (int(worst[c]), of(history.tcp[:, worst[c], c], tolerance)) for c, name in enumerate(moving)},
        sensors={name: of(history.temperature[:, s], temperature_tolerance) for s, name in enumerate(history.sensors)},
    )


def read_history(path: Path) -> History:
    """The history in a result.h5, or in the folder that holds it.

    Raises TwinError for other files, and for results of fewer than two steps.
    """
    path = Path(path) / "result.h5" if Path(path).is_dir() else Path(path)
    remedy = "make it with: twin run ARTEFACT RUN -o OUT"
    if not path.is_file():
        raise TwinError("no result here", str(path), remedy)
    try:
        with open_result(path) as (file, _), h5py.File(file, "r") as f:
            if f.attrs.get("format") != FORMAT:
                raise TwinError("not a result of `twin run`", str(path), remedy)
            history = History(
                time=f["time"][...] - f["time"][0],
                sensors=strings(f["sensor"]),
                temperature=f["temperature"][...],
                pose_axes=strings(f["pose_axis"]),
                poses=f["pose_position"][...],
                tcp=f["tcp"][...],
                tcp_actual=f["tcp_actual"][...],
            )
    except (OSError, KeyError) as e:
        raise TwinError("not a result of `twin run`", str(path), remedy) from e
    if len(history.time) < 3:
        raise TwinError("has less than two steps", str(path), "a warm-up needs a longer run, or a smaller --dt")
    return history
