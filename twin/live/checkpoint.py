"""The checkpoint: the state of the machine and of all that is between the source and it, at a position of the journal.

One file, written whole or not at all, with a checksum: a line of JSON, then the engine's bytes, then CRC-32 of both.
The one before is kept, in case the disk damages the last.
"""

from __future__ import annotations

import json
import os
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from twin.atomic import atomic_path
from twin.errors import TwinError

FORMAT = "twin live checkpoint 2"


@dataclass(frozen=True)
class Checkpoint:
    """What is stored."""

    told: dict[str, Any]  # plain numbers
    engine: bytes


def write_checkpoint(path: Path, checkpoint: Checkpoint) -> None:
    """Raises TwinError where it cannot be written."""
    line = json.dumps({"format": FORMAT, **checkpoint.told}).encode() + b"\n"
    with atomic_path(path) as temporary:
        crc = zlib.crc32(checkpoint.engine, zlib.crc32(line))
        temporary.write_bytes(line + checkpoint.engine + crc.to_bytes(4, "little"))
        if path.exists():
            os.replace(path, _before(path))


def read_checkpoint(path: Path) -> Checkpoint | None:
    """The last sound one; None where there is none."""
    for candidate in (path, _before(path)):
        found = _read(candidate)
        if found is not None:
            return found
    return None


def remove_checkpoint(path: Path) -> None:
    """And the one before it."""
    for candidate in (path, _before(path)):
        candidate.unlink(missing_ok=True)


def _before(path: Path) -> Path:
    return path.with_name(f"{path.name}.before")


def _read(path: Path) -> Checkpoint | None:
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as e:
        raise TwinError(f"cannot read: {e.strerror or e}", str(path), "check its permissions") from e
    at = data.find(b"\n") + 1
    if at == 0 or len(data) < at + 4 or zlib.crc32(data[:-4]) != int.from_bytes(data[-4:], "little"):
        return None
    told = json.loads(data[:at])
    if told.pop("format") != FORMAT:
        raise TwinError("of another version", str(path), "start afresh with --fresh, or name another --state")
    return Checkpoint(told, data[at:-4])
