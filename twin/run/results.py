"""What a replay yields, and its files: result.h5, temperatures.csv, tcp.csv, summary.json."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from twin.atomic import atomic_path, telling
from twin.errors import TwinError
from twin.logs.run import Table, Tcp
from twin.logs.write import write_table, write_tcp
from twin.rom.hdf5_file import image_of, put, put_attributes, scale
from twin.together import open_result

FORMAT = "twin result"


@dataclass(frozen=True)
class Result:
    """n steps; states and outputs at their n + 1 edges, heat and flags per step."""

    time: np.ndarray  # (n + 1,) s, as in the loads
    sensors: tuple[str, ...]  # structural ones, then those in the air
    temperature: np.ndarray  # (n + 1, n_sensors) degC
    pose_axes: tuple[str, ...]
    poses: np.ndarray  # (n_poses, n_pose_axes) m
    tcp: np.ndarray  # (n + 1, n_poses, 3) m, TCP error at every pose
    axes: tuple[str, ...]
    position: np.ndarray  # (n + 1, n_axes) m
    tcp_actual: np.ndarray  # (n + 1, 3) m, TCP error at the actual position
    sources: tuple[str, ...]
    power: np.ndarray  # (n, n_sources) W
    films: tuple[str, ...]
    film_heat: np.ndarray  # (n, n_films) W from the environments into the machine
    film_coefficient: np.ndarray  # (n, n_films) W/(m^2 K), radiation included
    film_surface: np.ndarray  # (n, n_films) degC: mean temperature of the films' surfaces at step starts
    stored: np.ndarray  # (n,) J
    balance_error: np.ndarray  # (n,) |stored - in| of the throughput, or of 1 uK of the machine where that is more
    flags: np.ndarray  # (n, n_flags) bool: outside what was certified
    flag_names: tuple[str, ...]
    states: np.ndarray  # (n + 1, N) artefact coordinates, bodies one after the other
    artefact: str  # sha256 of the model
    substeps: int
    moves: bool = True  # False: the machine has no TCP, or no temperature moves it, and `tcp` is zero
    turning: tuple[str, ...] = ()  # rotary axes that turn the tool or the work
    angle: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))  # (n + 1, n_turning) rad
    exact: bool = True  # `tcp_actual` is that of the position; False: interpolated between the poses

    @property
    def state(self) -> np.ndarray:
        """The final state (N,), to go on from."""
        return self.states[-1]


def summary(result: Result) -> dict[str, Any]:
    """Totals and extremes as JSON values; SI units in the names. "tcp" is None where nothing moves it."""
    dt = np.diff(result.time)
    flow = result.film_heat * dt[:, None]
    count = result.flags.sum(axis=0)
    return {
        "steps": len(dt),
        "step_s": float(dt[0]),
        "substeps": result.substeps,
        "duration_s": float(result.time[-1] - result.time[0]),
        "model_sha256": result.artefact,
        "heat": {
            "sources_J": float((result.power * dt[:, None]).sum()),
            "by_source_J": dict(zip(result.sources, (result.power.T @ dt).tolist(), strict=True)),
            "environments_in_J": float(flow[flow > 0].sum()),
            "environments_out_J": float(-flow[flow < 0].sum()),
            "stored_J": float(result.stored.sum()),
            "max_balance_error": float(result.balance_error.max()),
        },
        "temperature_degC": {
            name: {"min": float(column.min()), "max": float(column.max()), "final": float(column[-1])}
            for name, column in zip(result.sensors, result.temperature.T, strict=True)
        },
        "tcp": _tcp(result) if result.moves else None,
        "flagged_steps": int(result.flags.any(axis=1).sum()),
        "flags": {
            name: {"steps": int(k), "first_s": float(result.time[:-1][column][0]) if k else None}
            for name, k, column in zip(result.flag_names, count, result.flags.T, strict=True)
        },
    }


def _tcp(result: Result) -> dict[str, Any]:
    n, pose, component = np.unravel_index(np.argmax(np.abs(result.tcp)), result.tcp.shape)
    return {
        "max_abs_m": np.abs(result.tcp).max(axis=(0, 1)).tolist(),
        "at_actual_position": "exact" if result.exact else "interpolated between the poses",
        "max_abs_at_actual_position_m": np.abs(result.tcp_actual).max(axis=0).tolist(),
        "worst": {
            "component": "xyz"[component],
            "value_m": float(result.tcp[n, pose, component]),
            "time_s": float(result.time[n]),
            "pose_m": dict(zip(result.pose_axes, result.poses[pose].tolist(), strict=True)),
        },
    }


def refuse_run_folder(folder: Path) -> None:
    """Raises TwinError for a run folder: results would replace its measured temperatures.csv and tcp.csv."""
    if any((folder / name).exists() for name in ("run.toml", "loads.csv")):
        raise TwinError("is a run folder, not one for results", str(folder), "choose another folder with -o")


def write_results(folder: Path, result: Result, facts: Mapping[str, Any]) -> dict[str, Any]:
    """Write all files of a result; returns the summary, led by `facts`. Where nothing moves the TCP, no tcp.csv.

    All are written before the first of an earlier result is replaced, summary.json last: it names the SHA-256 of the
    others ("files"), by which a reader knows that they belong together, whenever it reads them.
    Raises TwinError if a file cannot be written, and for run folders; files then are as they were.
    """
    folder = Path(folder)
    refuse_run_folder(folder)
    told = {**facts, **summary(result)}
    columns = dict(zip(result.sensors, result.temperature.T, strict=True))
    temperatures = Table(result.time, columns, dict.fromkeys(columns, "degC"))
    writers: dict[str, Callable[[Path], object]] = {
        "result.h5": lambda path: _write_hdf5(path, result),
        "temperatures.csv": lambda path: write_table(path, temperatures),
    }
    if result.moves:
        angles = dict(zip(result.turning, result.angle.T, strict=False))
        tcp = Tcp(result.time, result.axes, result.position, result.tcp_actual, angle=angles)
        writers["tcp.csv"] = lambda path: write_tcp(path, tcp)
    with ExitStack() as stack:  # the last one entered is renamed first
        last = stack.enter_context(atomic_path(folder / "summary.json"))
        paths = {name: stack.enter_context(atomic_path(folder / name)) for name in reversed(writers)}
        for name, write in writers.items():
            with telling(folder / name):
                write(paths[name])
        told["files"] = {name: sha256(paths[name].read_bytes()).hexdigest() for name in writers}
        with telling(folder / "summary.json"):
            last.write_text(json.dumps(told, indent=2) + "\n", encoding="utf-8")
        if not result.moves:
            (folder / "tcp.csv").unlink(missing_ok=True)  # of an earlier result
    return told


def _write_hdf5(path: Path, result: Result) -> None:
    with image_of(path) as f:
        put_attributes(f, {"format": FORMAT, "artefact": result.artefact, "substeps": result.substeps})
        scale(f, "time", result.time, "s", "step edges")
        scale(f, "step", np.arange(len(result.time) - 1), "", "from time[step] to time[step + 1]")
        for name, values in (("sensor", result.sensors), ("axis", result.axes), ("pose_axis", result.pose_axes),
                             ("source", result.sources), ("film", result.films), ("flag", result.flag_names),
                             ("component", ("x", "y", "z"))):  # fmt: skip
            scale(f, name, values)
        scale(f, "pose", np.arange(len(result.poses)))
        scale(f, "state", np.arange(result.states.shape[1]), "", "bodies one after the other")
        put(f, "temperature", result.temperature, "degC", ("time", "sensor"))
        put(f, "tcp", result.tcp, "m", ("time", "pose", "component"), "TCP error at all poses")
        at_position = "TCP error at the actual position" + ("" if result.exact else ", interpolated between the poses")
        put(f, "tcp_actual", result.tcp_actual, "m", ("time", "component"), at_position)
        put(f, "pose_position", result.poses, "m", ("pose", "pose_axis"))
        put(f, "position", result.position, "m", ("time", "axis"))
        if result.turning:
            scale(f, "rotary_axis", result.turning)
            put(f, "angle", result.angle, "rad", ("time", "rotary_axis"), "of axes that turn tool or work")
        put(f, "power", result.power, "W", ("step", "source"))
        put(f, "film_heat", result.film_heat, "W", ("step", "film"), "from environments into the machine")
        put(f, "film_coefficient", result.film_coefficient, "W/(m^2*K)", ("step", "film"), "convection and radiation")
        put(f, "film_surface", result.film_surface, "degC", ("step", "film"), "mean surface temperature")
        put(f, "stored", result.stored, "J", ("step",))
        put(f, "balance_error", result.balance_error, "1", ("step",))
        put(f, "flags", result.flags.astype(np.uint8), "", ("step", "flag"), "1: outside what was certified")
        put(f, "states", result.states, "K", ("time", "state"), "modal coordinates of the artefact")


@contextmanager
def result_file(path: Path, artefact: str, remedy: str) -> Iterator[tuple[h5py.File, dict[str, Any]]]:
    """An open result.h5 of the model with this sha256, and its summary.json as far as there is one.

    path: the file, or the folder of `twin run -o`.

    Raises TwinError for other files, for results of other artefacts, and for what is missing while it is read.
    """
    try:
        with open_result(path) as (file, told), h5py.File(file, "r") as f:
            if f.attrs.get("format") != FORMAT:
                raise TwinError("not a result of `twin run`", str(path), remedy)
            if f.attrs["artefact"] != artefact:
                raise TwinError("a result of another artefact", str(path), remedy)
            yield f, told
    except (OSError, KeyError) as e:
        raise TwinError("not a result of `twin run`", str(path), remedy) from e


def read_final_state(path: Path, artefact: str) -> np.ndarray:
    """The state (N,) at the end of a result.h5 of the model with this sha256, to go on from.

    Raises TwinError for other files and results of other artefacts.
    """
    remedy = "give a temperature in degC or the result.h5 of a run of this artefact"
    with result_file(path, artefact, remedy) as (f, _):
        return np.asarray(f["states"][-1])
