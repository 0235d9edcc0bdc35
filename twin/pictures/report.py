"""All pictures of a result."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from twin.atomic import atomic_path
from twin.machine.description import Machine
from twin.pictures.placed import described, placed_surface, poses_in_space
from twin.pictures.raster import Camera
from twin.pictures.result import Drawn, read_result
from twin.pictures.surface import surface_figure
from twin.pictures.tcp_error import tcp_figure
from twin.pictures.temperatures import temperature_figure
from twin.pictures.workspace import workspace_figure
from twin.progress import Progress, silent
from twin.rom.artefact import Artefact

_SHARES = (1 / 12, 1 / 3, 1 / 2, 1.0)  # of a run: the four times of the surface picture


def write_pictures(artefact: Artefact, folder: Path, progress: Progress = silent) -> list[Path]:
    """Draw the result in `folder` into it as PNG files; returns their paths.

    The surface is left out where the artefact carries no field basis (lumped machines), the workspace where it has a
    single pose, and all of the TCP where no temperature moves it.
    Raises TwinError where the folder holds no result of this artefact, or cannot be written.
    """
    result = read_result(folder, artefact)
    machine = described(artefact)
    drawings: dict[str, tuple[str, Callable[[], Figure]]] = {
        "temperatures": ("Temperatures at the sensors", lambda: _temperatures(artefact, result)),
    }
    if artefact.model.moves:
        drawings["tcp"] = (
            "TCP displacement over time",
            lambda: tcp_figure(result.hours, result.tcp_actual, result.tcp, result.middle, result.outside),
        )
    if artefact.model.moves and len(result.poses) > 1:
        drawings["workspace"] = ("The distorted workspace", lambda: _workspace(machine, artefact, result))
    if artefact.fields:
        drawings["surface"] = ("Surface temperature", lambda: surface_of(artefact, result, machine))
    written = []
    with progress("pictures", len(drawings)) as advance:
        for name, (caption, draw) in drawings.items():
            advance(caption)
            written.append(_save(draw(), Path(folder) / f"{name}.png"))
    return written


def surface_of(
    artefact: Artefact, result: Drawn, machine: Machine, hours: tuple[float, ...] = (), camera: Camera | None = None
) -> Figure:
    """The surface at the given times [h], four over the run by default, each with the axes where they then were."""
    edges = [result.at(h) for h in hours or tuple(s * float(result.hours[-1]) for s in _SHARES)]
    sizes = [body.n for body in artefact.model.bodies]
    first = dict(zip((b.name for b in artefact.model.bodies), np.cumsum([0, *sizes[:-1]]), strict=True))
    T_ref = artefact.model.reference_temperature

    def temperature(edge: int) -> np.ndarray:
        x = result.states[edge]
        return np.concatenate([T_ref + f.basis @ x[first[f.body] :][: f.basis.shape[1]] for f in artefact.fields])

    return surface_figure(
        [placed_surface(machine, artefact, result.position_at(e), result.angle[e].tolist()) for e in edges],
        [temperature(e) for e in edges],
        [_after(result.hours[e]) for e in edges],
        camera or Camera.from_front("xyz".index(machine.machine.vertical)),
        "Surface temperature",
    )


def _temperatures(artefact: Artefact, result: Drawn) -> Figure:
    air = [name for name, _ in artefact.model.ambient_sensors]
    return temperature_figure(result.hours, result.temperature, result.sensors, air)


def _workspace(machine: Machine, artefact: Artefact, result: Drawn) -> Figure:
    worst = int(np.abs(result.tcp).max(axis=(1, 2)).argmax())
    return workspace_figure(
        poses_in_space(machine, result.pose_axes, result.poses),
        result.tcp[worst],
        [len(nodes) for nodes in artefact.model.pose_grid],
        f"The workspace {_after(result.hours[worst])}, when it is distorted most",
        "xyz".index(machine.machine.vertical),
    )


def _after(hours: float) -> str:
    return f"after {60 * hours:.0f} min" if hours < 1.5 and hours != 1.0 else f"after {hours:.3g} h"


def _save(figure: Figure, path: Path) -> Path:
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format="png", metadata={"Software": None})  # equal input, equal bytes
    return path
