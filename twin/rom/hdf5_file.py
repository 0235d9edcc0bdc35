"""HDF5 files that appear whole or not at all, equal bytes for equal content, with units and named dimensions.

A file is made in memory and written in one go: a full disk then is an ordinary OSError, where HDF5 itself may abort
while closing. Default library version bounds: files with libver="latest" are unreadable for VTK 9 and HDF5 1.10.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from twin.atomic import atomic_path
from twin.rom.names import has_control_characters


@contextmanager
def writing(path: Path, finish: Callable[[bytes], bytes] = bytes) -> Iterator[h5py.File]:
    """An open, empty HDF5 file that is written to `path` when the block ends without an error.

    finish: what becomes of its bytes before.

    Raises TwinError if the disk is full or the folder cannot be written.
    """
    with atomic_path(path) as temporary, image_of(temporary, finish) as f:
        yield f


@contextmanager
def image_of(path: Path, finish: Callable[[bytes], bytes] = bytes) -> Iterator[h5py.File]:
    """The same straight to `path`, a temporary name of the caller's. Raises OSError if it cannot be written."""
    with h5py.File(path.name, "w", driver="core", backing_store=False) as f:
        yield f
        f.flush()
        image = f.id.get_file_image()
    path.write_bytes(finish(image))


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


def floats(group: h5py.Group, name: str, where: str = "", bits: int = 64) -> np.ndarray:
    """A dataset of finite floating-point numbers of so many bits; `where` names the group in messages.

    Raises KeyError where it is missing, of another type, or not finite.
    """
    values = _array(group, name, where, np.dtype(f"f{bits // 8}"))
    if not np.isfinite(values).all():
        raise KeyError(f"'{_path(where, name)}' holds values that are not finite")
    return values


def integers(group: h5py.Group, name: str, where: str = "", bits: int = 64) -> np.ndarray:
    """A dataset of whole numbers of so many bits. Raises KeyError where it is missing or of another type."""
    return _array(group, name, where, np.dtype(f"i{bits // 8}"))


def texts(group: h5py.Group, name: str, where: str = "") -> tuple[str, ...]:
    """A dataset (n,) of text. Raises KeyError where it is missing, of another type, or holds control characters."""
    dataset = member(group, name, where)
    if not isinstance(dataset, h5py.Dataset) or h5py.check_string_dtype(dataset.dtype) is None or dataset.ndim != 1:
        raise KeyError(f"'{_path(where, name)}' is no list of text")
    values = strings(dataset)
    if any(has_control_characters(value) for value in values):
        raise KeyError(f"'{_path(where, name)}' holds a name with control characters")
    return values


def text(group: h5py.Group, name: str, where: str = "") -> str:
    """A dataset () of text. Raises KeyError where it is missing or of another type."""
    dataset = member(group, name, where)
    if not isinstance(dataset, h5py.Dataset) or h5py.check_string_dtype(dataset.dtype) is None or dataset.ndim:
        raise KeyError(f"'{_path(where, name)}' is no text")
    return str(dataset.asstr()[()])


def member(group: h5py.Group, name: str, where: str = "") -> Any:
    """The object of this name in a group. Raises KeyError where it is missing."""
    if name not in group:
        raise KeyError(f"'{_path(where, name)}' is missing")
    return group[name]


def _array(group: h5py.Group, name: str, where: str, dtype: np.dtype) -> np.ndarray:
    dataset = member(group, name, where)
    if not isinstance(dataset, h5py.Dataset):
        raise KeyError(f"'{_path(where, name)}' is a group, not numbers")
    if dataset.dtype != dtype:
        raise KeyError(f"'{_path(where, name)}' is of type {dataset.dtype}, not {dtype}")
    return np.asarray(dataset[()])


def _path(where: str, name: str) -> str:
    return f"{where}/{name}" if where else name
