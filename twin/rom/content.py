"""What an HDF5 file holds, object by object, and one hash over all of it.

The hash is over what a reader gets, not over the bytes of the file: a file that was rewritten by another tool keeps it,
and a file of which any readable bit changed does not. It is written down in docs/artefact.md, for readers in other
languages. A hash over the raw bytes was rejected: no HDF5 tool could make or keep it.

Objects reached by soft and external links, and data stored in other files, are refused: what they hold can change
without the file.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np

HASH = "content_sha256"  # attribute of the root; the one thing the hash is not over
_PLAIN = "iufS"  # numbers and fixed-length text: hashed byte by byte


class ForeignContent(Exception):
    """Something that is not stored, plainly, in the file itself: `args` are what it is and the path it stands at."""


@dataclass(frozen=True)
class Item:
    """A group, a dataset, or an attribute of either."""

    kind: str  # "group", "dataset" or "attribute"
    path: str  # "/bodies/bed/E"; of an attribute "/bodies/bed/E@units"
    dtype: str  # "<f8", "text" or "reference"; "" of groups
    shape: tuple[int, ...]
    data: bytes  # in C order; text and references (paths) as JSON

    @property
    def head(self) -> bytes:
        """What it is: one line of JSON."""
        return json.dumps([self.kind, self.path, self.dtype, list(self.shape)]).encode() + b"\n"


def items(f: h5py.File) -> Iterator[Item]:
    """All that a file holds but its hash: the objects by path, each followed by its attributes by name.

    Raises ForeignContent for soft and external links, objects of two names, data in other files, and storage or types
    that artefacts do not have; what h5py raises for damaged files.
    """
    objects: dict[str, h5py.Group | h5py.Dataset] = {}
    paths: dict[int, str] = {}
    _gather(f, "/", objects, paths)
    for path, item in objects.items():
        yield Item("group", path, "", (), b"") if isinstance(item, h5py.Group) else _dataset(item, path)
        yield from _attributes(item, path, paths)


def content_hash(f: h5py.File) -> str:
    """SHA-256 over `items`, as hexadecimal digits. Raises as `items`."""
    digest = hashlib.sha256()
    for item in items(f):
        digest.update(item.head)
        digest.update(item.data)
    return digest.hexdigest()


def stamp(f: h5py.File) -> None:
    """Write the hash of all that a file holds now as its attribute HASH."""
    f.attrs[HASH] = np.bytes_(content_hash(f))  # fixed length


def _gather(
    item: h5py.Group | h5py.Dataset, path: str, objects: dict[str, h5py.Group | h5py.Dataset], paths: dict[int, str]
) -> None:
    """Fill in the objects by path, and paths by the objects' addresses, depth first."""
    address = h5py.h5o.get_info(item.id).addr
    if address in paths:  # within itself, such a group would have no end
        raise ForeignContent(f"a second name of '{paths[address]}'", path)
    objects[path], paths[address] = item, path
    if isinstance(item, h5py.Dataset):
        return
    for name in sorted(item):
        own = f"{path.rstrip('/')}/{name}"
        link = item.get(name, getlink=True)
        if isinstance(link, h5py.SoftLink):
            raise ForeignContent(f"a soft link to '{link.path}'", own)
        if isinstance(link, h5py.ExternalLink):
            raise ForeignContent(f"a link to '{link.path}' in the file '{link.filename}'", own)
        member = item[name]
        if not isinstance(member, h5py.Group | h5py.Dataset):
            raise ForeignContent(f"a {type(member).__name__}, which no artefact has", own)
        _gather(member, own, objects, paths)


def _dataset(dataset: h5py.Dataset, path: str) -> Item:
    if dataset.external:
        raise ForeignContent(f"data in the file '{dataset.external[0][0]}'", path)
    if dataset.is_virtual:
        raise ForeignContent("data gathered from other datasets", path)
    if dataset.chunks is not None or dataset.shape is None:
        raise ForeignContent("chunked, compressed or null storage", path)
    dtype, shape = dataset.dtype, dataset.shape
    # what is declared and not stored would be read as zeros, of any size
    if dataset.id.get_storage_size() < math.prod(shape) * dtype.itemsize:
        raise ForeignContent(f"of shape {shape}, more than the file holds", path)
    if _is_text(dtype):
        return Item("dataset", path, "text", shape, json.dumps(_texts(dataset[()])).encode())
    if dtype.kind not in _PLAIN:
        raise ForeignContent(f"of type {dtype}, which no artefact has", path)
    return Item("dataset", path, dtype.str, shape, np.ascontiguousarray(dataset[()]).tobytes())


def _attributes(owner: h5py.Group | h5py.Dataset, path: str, paths: dict[int, str]) -> Iterator[Item]:
    identifier = owner.id
    count = h5py.h5a.get_num_attrs(identifier)
    attributes = {a.name: a for a in (h5py.h5a.open(identifier, index=i) for i in range(count))}
    for name, attribute in sorted(attributes.items()):
        text = name.decode()
        if path == "/" and text == HASH:
            continue
        values = np.empty(attribute.shape, dtype=attribute.dtype)
        attribute.read(values)
        if _is_text(attribute.dtype):
            dtype, data = "text", json.dumps(_texts(values[()])).encode()
        elif attribute.dtype.kind in _PLAIN:
            dtype, data = attribute.dtype.str, values.tobytes()
        else:  # of dimension scales
            dtype, data = "reference", json.dumps(_targets(values[()], identifier, paths)).encode()
        yield Item("attribute", f"{path}@{text}", dtype, attribute.shape, data)


def _is_text(dtype: np.dtype) -> bool:
    """Whether it is text of variable length."""
    return bool(dtype.kind == "O" and h5py.check_string_dtype(dtype) is not None)


def _texts(value: Any) -> Any:
    """Text (nested) as JSON values."""
    return value.decode("utf-8") if isinstance(value, bytes) else [_texts(v) for v in value]


def _targets(value: Any, file: h5py.h5g.GroupID, paths: dict[int, str]) -> Any:
    """References (nested, beside numbers) as JSON values: the paths of what they point to."""
    if isinstance(value, h5py.Reference):
        try:
            return paths.get(h5py.h5o.get_info(h5py.h5r.dereference(value, file)).addr, "")
        except (KeyError, OSError, RuntimeError, ValueError):  # to what was removed from the file
            return ""
    if isinstance(value, np.integer):
        return int(value)
    return [_targets(v, file, paths) for v in value]
