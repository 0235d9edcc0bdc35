"""Stages of a build that are dear and depend on their inputs only: kept in the user's cache folder.

An interrupted or repeated build resumes after the last finished stage. Entries are pickles of our own types in the
user's private folder ($TWIN_CACHE or ~/.cache/twin); an unreadable entry is made again. HDF5 was rejected here: nothing
else ever reads these files, and they die with the version of the code that wrote them (it is part of the key).
"""

from __future__ import annotations

import hashlib
import os
import pickle
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from twin.atomic import atomic_path
from twin.errors import TwinError
from twin.machine.description import Machine

T = TypeVar("T")
KEEP = 12  # entries; older ones are removed


def folder() -> Path:
    return Path(os.environ.get("TWIN_CACHE") or Path.home() / ".cache" / "twin")


def source_hash() -> str:
    """Hash of the code that makes the stages."""
    digest = hashlib.sha256()
    package = Path(__file__).parents[1]
    for layer in ("physics", "rom", "machine", "build"):
        for path in sorted((package / layer).glob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()


def machine_hash(machine: Machine) -> str:
    """Hash of the description's content and of every mesh file it names; tolerances of parameters change no model."""
    digest = hashlib.sha256(machine.model_dump_json(exclude={"folder", "parameters"}).encode())
    for name, part in sorted(machine.parts.items()):
        if part.mesh is not None:
            digest.update(name.encode())
            digest.update((machine.folder / part.mesh).read_bytes())
    return digest.hexdigest()


def cached(stage: str, key: tuple[object, ...], make: Callable[[], T]) -> T:
    """The stage's result from the cache, or made and stored."""
    name = hashlib.sha256(repr((stage, source_hash(), *key)).encode()).hexdigest()[:24]
    path = folder() / f"{stage}-{name}.pickle"
    try:
        result = pickle.loads(path.read_bytes())
        with suppress(OSError):  # a read-only cache keeps its order
            path.touch()
        return result
    except FileNotFoundError:
        pass
    except Exception:  # whatever is wrong with a cache entry, the remedy is to make it again
        with suppress(OSError):
            path.unlink(missing_ok=True)
    result = make()
    try:
        with atomic_path(path) as temporary, open(temporary, "wb") as f:
            pickle.dump(result, f, protocol=5)
        entries = sorted(folder().glob("*.pickle"), key=lambda p: p.stat().st_mtime)
        for old in entries[:-KEEP]:
            old.unlink(missing_ok=True)
    except TwinError:
        pass  # a full or read-only cache costs time at the next build, nothing else
    return result
