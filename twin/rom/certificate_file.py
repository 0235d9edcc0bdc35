"""The certificate in an artefact: tables of numbers as datasets, the rest as JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np

from twin.rom.hdf5_file import floats, put, scale, text
from twin.units import LARGEST

MOST_SUBSTEPS = 10_000  # of a step: builds choose up to some tens, and a step of a day would still be one of 9 s


def _numbers(value: object) -> np.ndarray | None:
    """Arrays and non-empty (nested) sequences of numbers as a float array, else None."""
    if isinstance(value, np.ndarray):
        return value.astype(float)
    if not isinstance(value, list | tuple) or not value:
        return None
    try:
        table = np.array(value)
    except ValueError:
        return None
    return table.astype(float) if table.dtype.kind in "fi" else None


# Tables of a certificate by the scales that artefacts have anyway; others get their own.
_CERTIFIED: dict[str, tuple[str, ...]] = dict.fromkeys(
    ("temperature_error", "temperature_range", "temperature_error_in_case", "temperature_range_in_case"), ("sensor",)
) | dict.fromkeys(
    ("displacement_error", "displacement_range", "displacement_error_in_case", "displacement_range_in_case"),
    ("pose", "component"),
)


def write_certificate(group: h5py.Group, certificate: Mapping[str, Any]) -> None:
    """Fill an empty group. Numbers get K or m as their unit where their name says "temperature" or "displacement"."""
    tables = {name: _numbers(value) for name, value in sorted(certificate.items())}
    rest = {name: value for name, value in certificate.items() if tables[name] is None}
    put(group, "json", json.dumps(rest, sort_keys=True), "")
    for name, table in tables.items():
        if table is None:
            continue
        unit = "K" if "temperature" in name else "m" if "displacement" in name or name == "positions" else ""
        dims = _CERTIFIED.get(name)
        if dims is None:
            dims = tuple(f"{name}_{axis}" for axis in range(table.ndim))
            for dim, size in zip(dims, table.shape, strict=True):
                scale(group, dim, np.arange(size))
        put(group, name, table, unit, dims)


def read_certificate(group: h5py.Group) -> dict[str, Any]:
    """The certificate, its tables as arrays. Raises KeyError for damage, and for steps that no run can take."""
    told = json.loads(text(group, "json", "certificate"))
    if not isinstance(told, dict):
        raise KeyError("'certificate/json' is no object")
    for name in ("step", "finest_step", "substeps"):
        value = told.get(name, 1)
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value <= LARGEST:
            raise KeyError(f"'certificate/json' has a {name} that is no number above 0")
    substeps = told.get("substeps", 1)
    if substeps != int(substeps) or substeps > MOST_SUBSTEPS:
        raise KeyError(f"'certificate/json' has {substeps:g} substeps, not a whole number up to {MOST_SUBSTEPS}")
    tables = {name: floats(group, name, "certificate") for name in group if name != "json" and not group[name].is_scale}
    return told | tables
