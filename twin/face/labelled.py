"""Numbers with named dimensions and units, as xarray."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from twin.errors import TwinError

if TYPE_CHECKING:
    import numpy as np
    import xarray

Coordinates = Mapping[str, tuple[Any, str]]  # values and unit by dimension


def labelled(
    values: np.ndarray, dims: Sequence[str], coordinates: Coordinates, name: str, unit: str, long_name: str
) -> xarray.DataArray:
    """`values` with the given dimensions, each with its coordinate. Raises TwinError where xarray is missing."""
    try:
        import xarray
    except ModuleNotFoundError as e:
        remedy = "python -m pip install 'twin[build]'; the plain numbers are in result.numbers"
        raise TwinError("the package 'xarray' is missing", f"result.{name}", remedy) from e
    found = {
        dim: (dim, of_dim, {"units": of_unit} if of_unit else {})
        for dim, (of_dim, of_unit) in coordinates.items()
        if dim in dims
    }
    return xarray.DataArray(values, found, dims, name, {"units": unit, "long_name": long_name})
