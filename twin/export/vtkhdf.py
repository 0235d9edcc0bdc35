"""A series as one VTKHDF file (VTK 9.3 and later; ParaView 5.11 shows its first time only, `vtk` shows all).

An unstructured grid in steps, version 2.0 of the format; the cells are stored once, points and data once per time.
Source: VTK file formats, VTKHDF, transient data (docs.vtk.org).
"""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from twin.export.frames import Frames, frames_of
from twin.export.options import ExportOptions
from twin.rom.artefact import Artefact
from twin.rom.hdf5_file import writing

CELL_TYPES = {"triangle": 5, "tetra10": 24}  # VTK_TRIANGLE, VTK_QUADRATIC_TETRA


def export_vtkhdf(artefact: Artefact, path: Path, options: ExportOptions) -> tuple[str, ...]:
    """The format `vtkhdf`. Raises TwinError as `frames_of`, and where the file cannot be written."""
    series = frames_of(artefact, options)
    with writing(path) as f:
        _write(f, series)
    return (
        f"{path}: {series.count} times, {len(series.cells)} cells ({series.cell_type})"
        + (f", {series.note}" if series.note else ""),
    )


def _write(f: h5py.File, series: Frames) -> None:
    n, cells, corners = series.count, *series.cells.shape
    root = f.create_group("VTKHDF")
    f.attrs["note"] = series.note  # beside what VTK reads
    root.attrs["Version"] = np.array([2, 0])
    root.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", len("UnstructuredGrid")))
    root["NumberOfCells"] = [cells]
    root["NumberOfConnectivityIds"] = [series.cells.size]
    root["Connectivity"] = series.cells.ravel().astype(np.int64)
    root["Offsets"] = corners * np.arange(cells + 1, dtype=np.int64)
    root["Types"] = np.full(cells, CELL_TYPES[series.cell_type], dtype=np.uint8)
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = n
    times, size = np.zeros(n), 0
    for k, frame in enumerate(series.frames):
        times[k], size = frame.time, len(frame.points)
        for name, values in (("Points", frame.points), *((f"PointData/{d}", v) for d, v in frame.data.items())):
            if name not in root:
                root.create_dataset(name, (n * size, *values.shape[1:]), dtype=float)
            root[name][k * size : (k + 1) * size] = values
    first = size * np.arange(n)
    root["NumberOfPoints"] = [size]
    steps["Values"] = times
    steps["PartOffsets"], steps["NumberOfParts"] = np.zeros(n, dtype=np.int64), np.ones(n, dtype=np.int64)
    steps["PointOffsets"] = first
    steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = np.zeros((n, 1), dtype=np.int64)
    for name in root["PointData"]:
        steps[f"PointDataOffsets/{name}"] = first
