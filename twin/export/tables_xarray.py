"""A result as netCDF4, written by xarray through h5netcdf: `xarray.open_dataset(FILE, engine="h5netcdf")`."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

from twin.atomic import atomic_path
from twin.errors import TwinError
from twin.export.options import ExportOptions
from twin.export.run_result import RunResult, result_of
from twin.rom.artefact import Artefact

if TYPE_CHECKING:
    import xarray


def export_xarray(artefact: Artefact, path: Path, options: ExportOptions) -> tuple[str, ...]:
    """The format `xarray`. Raises TwinError as `result_of`, and where xarray or h5netcdf are missing."""
    result = result_of(artefact, options)
    data = dataset(result)
    image = io.BytesIO()  # as `twin.rom.hdf5_file.writing`: a full disk is an OSError, not the end of the process
    data.to_netcdf(image, engine="h5netcdf")
    with atomic_path(path) as temporary:
        temporary.write_bytes(image.getvalue())
    sizes = ", ".join(f"{size} {name}" for name, size in data.sizes.items())
    return (f"{path}: {', '.join(result.tables)} over {sizes}",)


def dataset(result: RunResult) -> xarray.Dataset:
    """Every table as a variable, with `units` and `long_name`. Raises TwinError where a package is missing."""
    try:
        import h5netcdf
        import xarray
    except ModuleNotFoundError as e:
        remedy = "python -m pip install xarray h5netcdf, or choose --format json"
        raise TwinError(f"the package '{e.name}' is missing", "--format xarray", remedy) from e
    return xarray.Dataset(
        {n: (t.dims, t.values, {"units": t.unit, "long_name": t.long_name}) for n, t in result.tables.items()},
        {n: (n, v, {"units": unit} if unit else {}) for n, (v, unit) in result.coordinates.items()},
        {"machine": result.machine, "artefact": result.artefact, "h5netcdf": h5netcdf.__version__},
    )
