"""A result as one CSV: a row per time; headers `name [unit]`, the shape of every table of this program.

Temperatures, axis positions, the TCP error at the actual position and what to add to the axes there. The TCP error at
all poses has three dimensions: it is in `json` and `xarray`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from twin.atomic import atomic_path
from twin.export.options import ExportOptions
from twin.export.run_result import RunResult, result_of
from twin.logs.run import Table
from twin.logs.write import write_table
from twin.rom.artefact import Artefact
from twin.run.correction_axes import axis_jacobian, offset_matrix


def export_csv(artefact: Artefact, path: Path, options: ExportOptions) -> tuple[str, ...]:
    """The format `csv`. Raises TwinError as `twin.export.run_result.result_of`, and where it cannot be written."""
    result = result_of(artefact, options)
    table = as_table(result, artefact)
    with atomic_path(path) as temporary:
        write_table(temporary, table)
    return (f"{path}: {len(table.time)} rows of {len(table.columns)} columns",)


def as_table(result: RunResult, artefact: Artefact) -> Table:
    """A row per time; columns temperature_SENSOR, position_AXIS, tcp_COMPONENT, offset_AXIS."""
    columns, units = {}, {}
    for name, label in (("temperature", "temperature"), ("position", "position"), ("tcp_actual", "tcp")):
        table = result.tables[name]
        of, _ = result.coordinates[table.dims[1]]
        for k, item in enumerate(of):
            columns[f"{label}_{item}"], units[f"{label}_{item}"] = table.values[:, k], table.unit
    axes = tuple(result.coordinates["pose_axis"][0].tolist())
    if "offset" in result.tables:
        there = result.tables["tcp_actual"].values @ offset_matrix(axis_jacobian(artefact, axes)).T
        for axis, values in zip(axes, there.T, strict=True):
            columns[f"offset_{axis}"], units[f"offset_{axis}"] = np.asarray(values), "m"
    return Table(result.coordinates["time"][0], columns, units)
