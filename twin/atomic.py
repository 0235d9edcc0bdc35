"""Files appear whole or not at all: write beside the target, then rename."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from twin.errors import TwinError


def check_folder(folder: Path) -> None:
    """Raises TwinError where files cannot be written to `folder`, which need not exist: before hours are spent."""
    remedy = "choose another folder with -o"
    there = next((p for p in (folder, *folder.absolute().parents) if p.exists()), folder)
    if not there.is_dir():
        raise TwinError("is a file, not a folder", str(there), remedy)
    if not os.access(there, os.W_OK | os.X_OK):
        raise TwinError("cannot write: Permission denied", str(there), f"check its permissions, or {remedy}")


def check_file(target: Path) -> None:
    """The same for a file to be written."""
    if target.is_dir():
        raise TwinError("is a folder, not a file", str(target), "name a file with -o")
    _not_a_device(target)
    check_folder(target.parent)


def _not_a_device(target: Path) -> None:
    """A rename would put a file in its place: /dev/null would be gone."""
    if target.exists() and not target.is_file() and not target.is_dir():
        raise TwinError("is a pipe or device, not an ordinary file", str(target), "name a file with -o")


def _cannot_write(e: OSError, target: Path) -> TwinError:
    return TwinError(
        f"cannot write: {e.strerror or e}", str(target), "free disk space or choose another folder with -o"
    )


@contextmanager
def atomic_path(target: Path) -> Iterator[Path]:
    """Yield a temporary path in the target's folder; rename it to `target` on success, remove it on any failure.

    Raises TwinError if the disk is full or the folder cannot be written, and for a target that is a pipe or device.
    """
    target = Path(target)
    _not_a_device(target)
    temporary = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        with open(temporary, "rb") as f:  # the rename must not overtake the data
            os.fsync(f.fileno())
        os.replace(temporary, target)
    except OSError as e:
        raise _cannot_write(e, target) from e
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def telling(target: Path) -> Iterator[None]:
    """What the disk refuses in this block is an error of `target`, whatever file was written. Raises TwinError."""
    try:
        yield
    except OSError as e:
        raise _cannot_write(e, target) from e


@contextmanager
def atomic_folder(target: Path) -> Iterator[Path]:
    """The same for a folder: yield a new temporary folder, rename it to `target` on success, an older one removed.

    Raises TwinError if the disk is full or the folder cannot be written.
    """
    target = Path(target)
    temporary = target.with_name(f".{target.name}.{os.getpid()}.part")
    old = target.with_name(f".{target.name}.{os.getpid()}.old")
    try:
        temporary.mkdir(parents=True)
        yield temporary
        if target.exists():
            os.replace(target, old)
        os.replace(temporary, target)
    except OSError as e:
        raise _cannot_write(e, target) from e
    finally:
        if old.exists() and not target.exists():  # interrupted between the two renames
            os.replace(old, target)
        import shutil  # a twentieth of the start of a process that only writes files

        shutil.rmtree(temporary, ignore_errors=True)
        shutil.rmtree(old, ignore_errors=True)
