"""The table of formats. A new one is one function in a file of its own, one row here, one test."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, cast

if TYPE_CHECKING:
    from twin.export.options import ExportOptions
    from twin.rom.artefact import Artefact

    # Writes the file, whole or not at all, and returns what to tell of it, a line each.
    Write = Callable[[Artefact, Path, ExportOptions], tuple[str, ...]]


@dataclass(frozen=True)
class Format:
    """One format; its module is imported when it is asked for."""

    function: str  # "twin.export.c.write:write_c"
    help: str  # one line
    options: tuple[str, ...] = ()  # fields of ExportOptions that it reads
    suffix: str = ""  # of its file
    folder: bool = False  # its output is a folder, with several files

    @property
    def write(self) -> Write:
        module, _, name = self.function.partition(":")
        return cast("Write", getattr(import_module(module), name))


RESULT, LINEAR, SERIES = ("result", "time"), ("result", "time", "at"), ("result", "frames", "field")

FORMATS: dict[str, Format] = {
    "c": Format("twin.export.c.write:write_c", "one C99 file and its header: the runtime", ("precision", "run"), ".c"),
    "fmu2": Format("twin.export.fmu.write:write_fmu2", "FMI 2.0 co-simulation, self-contained", ("poses",), ".fmu"),
    "fmu3": Format("twin.export.fmu.write:write_fmu3", "FMI 3.0 co-simulation, self-contained", ("poses",), ".fmu"),
    "mat": Format("twin.export.mat:export_mat", "MATLAB: state space and affine terms", LINEAR, ".mat"),
    "npz": Format("twin.export.npz:export_npz", "NumPy: state space and affine terms", LINEAR, ".npz"),
    "csv": Format("twin.export.tables_csv:export_csv", "a result, a row per time", ("result",), ".csv"),
    "json": Format("twin.export.tables_json:export_json", "a result, all tables", ("result",), ".json"),
    "xarray": Format("twin.export.tables_xarray:export_xarray", "a result as netCDF4", ("result",), ".nc"),
    "vtk": Format("twin.export.paraview:export_vtk", "ParaView: PVD and a VTU per time", SERIES, folder=True),
    "vtkhdf": Format("twin.export.vtkhdf:export_vtkhdf", "VTK 9.3 and later: one file", SERIES, ".vtkhdf"),
    "siemens": Format("twin.export.siemens:export_siemens", "SINUMERIK: temperature compensation", RESULT, ".spf"),
    "beckhoff": Format("twin.export.beckhoff:export_beckhoff", "TwinCAT CNC: temperature compensation", RESULT, ".lis"),
    "heidenhain": Format(
        "twin.export.heidenhain:export_heidenhain", "HEIDENHAIN: compensation-value tables", RESULT, folder=True
    ),
    "generic": Format("twin.export.generic:export_generic", "axis offsets on a grid, .csv or .json", RESULT, ".csv"),
}
