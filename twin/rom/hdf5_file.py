"""HDF5 files that appear whole or not at all, equal bytes for equal content, with units and named dimensions.

A file is made in memory and written in one go: a full disk then is an ordinary OSError, where HDF5 itself may abort
while closing. Default library version bounds: files with libver="latest" are unreadable for VTK 9 and HDF5 1.10.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np

from twin.atomic import atomic_path


@contextmanager
def writing(path: Path) -> Iterator[h5py.File]:
    """An open, empty HDF5 file that is written to `path` when the block ends without an error.

    Raises TwinError if the disk is full or the folder cannot be written.
    """
    with h5py.File(path.name, "w", driver="core", backing_store=False) as f:
        yield f
        f.flush()
        image = f.id.get_file_image()
    with atomic_path(path) as temporary:
        temporary.write_bytes(image)


def put(
    group: h5py.Group,
    name: str,
    values: np.ndarray | float | str | Sequence[str],
    unit: str,
    dims: Sequence[str] = (),
    long_name: str = "",
) -> h5py.Dataset:
    """A dataset with its unit; `dims` names its dimensions, each a scale made by `scale` in this group or above.

    values: numbers, a string, or a sequence of strings (n,).
    """
    if isinstance(values, np.ndarray | float):
        dataset = group.create_dataset(name, data=values, track_times=False)
    else:
        text = h5py.string_dtype("utf-8")
        data = values if isinstance(values, str) else np.array(values, dtype=object)
        dataset = group.create_dataset(name, data=data, dtype=text, track_times=False)
    if unit:
        dataset.attrs["units"] = unit
    if long_name:
        dataset.attrs["long_name"] = long_name
    for axis, dim in enumerate(dims):
        owner = group
        while dim not in owner:
            if owner.name == "/":
                raise KeyError(f"no dimension '{dim}' for {dataset.name}")
            owner = owner.parent
        dataset.dims[axis].attach_scale(owner[dim])
    return dataset


def scale(
    group: h5py.Group, name: str, values: np.ndarray | Sequence[str], unit: str = "", long_name: str = ""
) -> h5py.Dataset:
    """A dimension and its coordinate values."""
    dataset = put(group, name, values, unit, (), long_name)
    dataset.make_scale(name)
    return dataset


def put_attributes(group: h5py.Group, attributes: Mapping[str, str | int | float]) -> None:
    """Attributes in the mapping's order."""
    for name, value in attributes.items():
        group.attrs[name] = value


def strings(dataset: h5py.Dataset) -> tuple[str, ...]:
    """A string dataset (n,) as Python strings."""
    return tuple(str(s) for s in dataset.asstr()[...])
