"""Results that are expensive and depend on their inputs only, kept in the user's cache folder ($TWIN_CACHE).

An interrupted or repeated build resumes after the last finished stage. What decides whether an entry fits is the code
that makes it (`twin.build.import_closure`) and what it was given; an entry that is damaged, or holds anything but data
(`twin.build.cache_file`), is made again. The folder is held to a budget in bytes ($TWIN_CACHE_BYTES): what was not used
for longest goes first.
"""

from __future__ import annotations

import hashlib
import logging
import os
import re
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

import numpy as np

from twin.build.cache_file import read_entry, write_entry
from twin.build.import_closure import closure_hash
from twin.errors import ModelError, TwinError
from twin.machine.description import Machine

T = TypeVar("T")
BUDGET = 20_000_000_000  # bytes: twelve machines with a diagnosis each, docs/decisions/0013-cache.md
ENTRY = re.compile(r"[a-z]+-[0-9a-f]{24}\.(npz|pickle)")  # pickles: of older versions, never read
_log = logging.getLogger(__name__)


def folder() -> Path:
    return Path(os.environ.get("TWIN_CACHE") or Path.home() / ".cache" / "twin")


def budget() -> int:
    """Bytes that all entries together may take. Raises ModelError where $TWIN_CACHE_BYTES is no number."""
    wanted = os.environ.get("TWIN_CACHE_BYTES", "")
    if not wanted:
        return BUDGET
    if not wanted.isdecimal():
        raise ModelError(f"'{wanted}' is no number of bytes", "TWIN_CACHE_BYTES", "give 20000000000, say; 0 keeps none")
    return int(wanted)


def machine_hash(machine: Machine) -> str:
    """Hash of the description's content and of every mesh file it names; tolerances of parameters change no model."""
    digest = hashlib.sha256(machine.model_dump_json(exclude={"folder", "parameters"}).encode())
    for name, part in sorted(machine.parts.items()):
        if part.mesh is not None:
            digest.update(name.encode())
            digest.update((machine.folder / part.mesh).read_bytes())
    return digest.hexdigest()


def arrays_hash(arrays: Iterable[np.ndarray]) -> str:
    """Hash of arrays in their order: type, shape and values."""
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(f"{array.dtype.str}{array.shape}".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def cached(stage: str, module: str, inputs: tuple[object, ...], make: Callable[[], T]) -> T:
    """The result of `make` from the cache, or made and stored.

    stage: lower-case letters, the first part of the entry's name. module: the one whose code makes the result; it and
    all that it imports decide, so nothing that only uses the result should be among them. inputs: all that the result
    depends on besides, their repr tells them apart. Raises ModelError where $TWIN_CACHE_BYTES is no number; a cache
    that cannot be read or written costs time, nothing else.
    """
    most = budget()
    name = hashlib.sha256(repr((closure_hash(module), inputs)).encode()).hexdigest()[:24]
    path = folder() / f"{stage}-{name}.npz"
    try:
        result: T = read_entry(path)
        with suppress(OSError):  # a read-only cache keeps its order
            path.touch()
        return result
    except FileNotFoundError:
        pass
    except Exception as e:  # whatever is wrong with an entry, the remedy is to make it again
        _log.warning("cache: %s is not used and made again: %s", path, e)
    result = make()
    _store(path, result, most)
    return result


def _store(path: Path, result: object, most: int) -> None:
    """Write an entry of at most `most` bytes and remove the ones not used for longest beyond that, of all together."""
    try:
        if write_entry(path, result, most):
            _shrink(path.parent, most)
        else:
            _log.warning("cache: %s is not kept: larger than TWIN_CACHE_BYTES = %d", path.name, most)
    except TypeError as e:
        _log.warning("cache: %s is not kept: %s", path.name, e)
    except (OSError, TwinError):
        pass  # a full or read-only cache costs time at the next build, nothing else


def _shrink(where: Path, most: int) -> None:
    """Other processes may remove entries at the same time."""
    entries = []
    for path in where.iterdir():
        if ENTRY.fullmatch(path.name):
            with suppress(FileNotFoundError):
                status = path.stat()
                entries.append((status.st_mtime_ns, status.st_size, path))
    total = sum(size for _, size, _ in entries)
    for _, size, path in sorted(entries):
        if total <= most:
            return
        path.unlink(missing_ok=True)
        total -= size
