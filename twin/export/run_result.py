"""What `csv`, `json` and `xarray` write: a result of `twin run` with names, units and the axis offsets at the poses."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from twin.errors import TwinError
from twin.export.options import ExportOptions
from twin.rom.artefact import Artefact
from twin.rom.hdf5_file import strings
from twin.run.correction_axes import axis_jacobian, offset_matrix
from twin.run.correction_struts import on_struts
from twin.run.results import result_file


@dataclass(frozen=True)
class Quantities:
    """One table of numbers: named dimensions, unit, what it is."""

    values: np.ndarray
    dims: tuple[str, ...]
    unit: str
    long_name: str


@dataclass(frozen=True)
class RunResult:
    """A result; `coordinates` name the dimensions."""

    machine: str
    artefact: str  # sha256 of the model
    coordinates: dict[str, tuple[np.ndarray, str]]  # values and unit by dimension
    tables: dict[str, Quantities]


def named_result(
    artefact: Artefact, options: ExportOptions
) -> AbstractContextManager[tuple[h5py.File, dict[str, Any]]]:
    """The open result that the options name, and its summary. Raises TwinError without one, and as `result_file`."""
    remedy = "name the folder of `twin run -o`, made with this artefact"
    if options.result is None:
        raise TwinError("this format is of a result", "--result", remedy)
    return result_file(Path(options.result), artefact.digest, remedy)


def result_of(artefact: Artefact, options: ExportOptions) -> RunResult:
    """The result that the options name, all times. `offset` is what to add to the axes at every pose: -J^-1 w.

    Without the offsets where no axis moves the tool. Raises TwinError where no result is named, for other files and
    results of other artefacts.
    """
    with named_result(artefact, options) as (f, _):
        return _read(f, artefact)


def _read(f: h5py.File, artefact: Artefact) -> RunResult:
    names = {dim: np.array(strings(f[dim])) for dim in ("sensor", "axis", "pose_axis", "source", "component")}
    coordinates = {dim: (values, "") for dim, values in names.items()}
    coordinates |= {"time": (f["time"][...], "s"), "pose": (np.arange(len(f["pose_position"])), "")}
    coordinates["step"] = (f["time"][:-1], "s")
    tables = {
        "temperature": Quantities(f["temperature"][...], ("time", "sensor"), "degC", "temperature"),
        "position": Quantities(f["position"][...], ("time", "axis"), "m", "axis position"),
        "tcp_actual": Quantities(f["tcp_actual"][...], ("time", "component"), "m", "TCP error at the actual position"),
        "pose_position": Quantities(f["pose_position"][...], ("pose", "pose_axis"), "m", "axis positions of the poses"),
        "tcp": Quantities(f["tcp"][...], ("time", "pose", "component"), "m", "TCP error at the poses"),
        "power": Quantities(f["power"][...], ("step", "source"), "W", "heat of the sources"),
    }
    axes = tuple(names["pose_axis"].tolist())
    if axes and artefact.model.moves and not on_struts(artefact.model):  # theirs come with `twin correction`
        offset = tables["tcp"].values @ offset_matrix(axis_jacobian(artefact, axes)).T
        tables["offset"] = Quantities(offset, ("time", "pose", "pose_axis"), "m", "to add to the nominal axis position")
    return RunResult(artefact.model.name, artefact.digest, coordinates, tables)
