"""The journal: every block that went into the machine, in the order in which it went, written before it does.

Segments `000000001.twb` of frames as `twin.logs.frame` describes them, so that `twin unpack` makes a run folder of one.
A segment is only ever appended to. A crash costs the frame that was being written, which is cut off when the journal is
opened again; the source brings it once more, or it is lost and counted. Older segments are removed, so that all
together stay below a number of bytes; none that the checkpoint needs is.
"""

from __future__ import annotations

import mmap
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from twin.errors import TwinError
from twin.live.block import Block, block_of, frame_of
from twin.logs.frame import Frame, frames, packed

SEGMENTS = 16  # about so many: what is removed at once is a sixteenth
SYNC = 1.0  # s between writes to the disk itself: what a power failure may cost; a killed process loses nothing


@dataclass(frozen=True)
class Position:
    """Where the next frame goes."""

    segment: int
    offset: int  # bytes


class Journal:
    """Frames on the disk; one process at a time."""

    def __init__(self, folder: Path, most: int):
        """most: bytes of all segments. Raises TwinError where the folder cannot be written."""
        self.folder, self.most, self.size = folder, most, max(most // SEGMENTS, 1)
        self.needed = 0  # no segment from this one on is removed
        self._synced = 0.0
        try:
            folder.mkdir(parents=True, exist_ok=True)
            present = self._present()
            self._segment = present[-1] if present else 1
            self._cut()
            self._file = self._path(self._segment).open("ab", buffering=0)
        except OSError as e:
            raise _failed(e, folder) from e

    @property
    def position(self) -> Position:
        return Position(self._segment, self._file.tell())

    @property
    def bytes(self) -> int:
        """Of all segments."""
        return sum(self._path(k).stat().st_size for k in self._present())

    def append(self, block: Block) -> None:
        """Raises TwinError where the disk is full."""
        try:
            if self._file.tell() >= self.size:
                self._next()
            self._file.write(packed(frame_of(block)))
        except OSError as e:
            raise _failed(e, self.folder) from e

    def sync_when_due(self) -> None:
        """After SYNC s. Raises TwinError where the disk fails."""
        if time.monotonic() - self._synced >= SYNC:
            try:
                self.sync()
            except OSError as e:
                raise _failed(e, self.folder) from e

    def sync(self) -> None:
        """What was appended is on the disk itself when this returns, which may take a disk a tenth of a second."""
        os.fdatasync(self._file.fileno())
        self._synced = time.monotonic()

    def since(self, position: Position) -> Iterator[Block]:
        """All blocks from a position on."""
        for segment in self._present():
            path = self._path(segment)
            if segment < position.segment or path.stat().st_size == 0:
                continue
            with path.open("rb") as f, mmap.mmap(f.fileno(), 0, access=mmap.ACCESS_READ) as data:
                at = position.offset if segment == position.segment else 0
                yield from (block_of(found) for found in frames(data, at) if isinstance(found, Frame))

    def clear(self) -> None:
        """Begin anew."""
        self._file.close()
        for segment in self._present():
            self._path(segment).unlink()
        self._segment = 1
        self._file = self._path(1).open("ab", buffering=0)

    def close(self) -> None:
        self.sync()
        self._file.close()

    def _path(self, segment: int) -> Path:
        return self.folder / f"{segment:09d}.twb"

    def _present(self) -> list[int]:
        return sorted(int(p.stem) for p in self.folder.glob("*.twb") if p.stem.isdecimal())

    def _next(self) -> None:
        os.fdatasync(self._file.fileno())
        self._file.close()
        self._segment += 1
        self._file = self._path(self._segment).open("ab", buffering=0)
        total = self.bytes + self.size  # with the segment that begins
        for segment in self._present():
            if total > self.most and segment < min(self.needed, self._segment):
                total -= self._path(segment).stat().st_size
                self._path(segment).unlink()

    def _cut(self) -> None:
        """Cut off a frame at the end that was not written whole."""
        path = self._path(self._segment)
        if not path.exists() or path.stat().st_size == 0:
            return
        sound = 0
        with path.open("rb") as f, mmap.mmap(f.fileno(), 0, access=mmap.ACCESS_READ) as data:
            for found in frames(data):
                sound = found.end_at if isinstance(found, Frame) else sound
        if sound < path.stat().st_size:
            os.truncate(path, sound)


def _failed(e: OSError, folder: Path) -> TwinError:
    return TwinError(f"cannot write: {e.strerror or e}", str(folder), "free disk space, or choose another --state")
