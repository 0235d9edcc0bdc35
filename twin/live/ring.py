"""A ring of blocks in a file that two processes map (for example in /dev/shm): the newest ones, each with a checksum.

Little-endian:

    8 bytes  "TWRING1\\0"
    u32      slots, u32 bytes per slot
    u64      stream, u64 number of the next block, u32 CRC-32 of these two: the newest block has the number before
    ... up to 64 bytes
    slots    each u32 length, then a frame as in `twin.logs.frame`: block of number n in slot n mod slots

A writer writes the slot first, then which is the newest. A reader that meets a slot which is being written sees that
its checksum is wrong, or its number another, and takes it as not there (yet, or any more). Plain mmap of a file: on
Python 3.11 a process that attaches multiprocessing.shared_memory removes the segment when it exits.
"""

from __future__ import annotations

import mmap
import os
import struct
import zlib
from pathlib import Path

from twin.errors import TwinError
from twin.live.block import Block, block_of, frame_of
from twin.logs.frame import Frame, frames, packed

MARK = b"TWRING1\0"
_SIZES = struct.Struct("<II")
_NEWEST = struct.Struct("<QQ")
_U32 = struct.Struct("<I")
_AT_SIZES, _AT_NEWEST, _FIRST = 8, 16, 64
_AT_CRC = _AT_NEWEST + _NEWEST.size


class RingWriter:
    """One process writes."""

    def __init__(self, path: Path, slots: int = 256, slot: int = 1 << 18):
        """slots of so many bytes. A ring of the same shape goes on, another is replaced.

        Raises TwinError where the file cannot be made.
        """
        self.path, self.slots, self.slot = path, slots, slot
        size = _FIRST + slots * slot
        try:
            if not _is_ring(path, slots, slot):
                path.parent.mkdir(parents=True, exist_ok=True)
                part = path.with_name(f".{path.name}.{os.getpid()}.part")
                with part.open("wb") as f:
                    f.truncate(size)
                    f.write(MARK + _SIZES.pack(slots, slot))
                os.replace(part, path)  # readers see it whole
            with path.open("r+b") as f:
                self._map = mmap.mmap(f.fileno(), size)
        except OSError as e:
            raise TwinError(
                f"cannot write: {e.strerror or e}", str(path), "name a file in /dev/shm, for example"
            ) from e

    def write(self, block: Block) -> None:
        """Raises ValueError for a block that no slot can hold."""
        data = packed(frame_of(block))
        if len(data) + _U32.size > self.slot:
            raise ValueError(f"a block of {len(data)} bytes for slots of {self.slot}")
        at = _FIRST + (block.sequence % self.slots) * self.slot
        self._map[at : at + _U32.size + len(data)] = _U32.pack(len(data)) + data
        newest = _NEWEST.pack(block.stream, block.sequence + 1)
        self._map[_AT_NEWEST : _AT_CRC + _U32.size] = newest + _U32.pack(zlib.crc32(newest))

    def next(self) -> tuple[int, int] | None:
        """Stream and number of the block to come after the newest, as a writer that starts anew finds them."""
        return _next(self._map)

    def close(self) -> None:
        self._map.close()


class RingReader:
    """Any number of processes read."""

    def __init__(self, path: Path):
        """Raises TwinError where there is no ring."""
        remedy = "start its writer first; docs/live.md has the format"
        try:
            with path.open("rb") as f:
                head = f.read(_FIRST)
                if head[:8] != MARK:
                    raise TwinError("is no ring of blocks", str(path), remedy)
                self.slots, self.slot = _SIZES.unpack_from(head, _AT_SIZES)
                self._inode = os.fstat(f.fileno()).st_ino
                self._map = mmap.mmap(f.fileno(), _FIRST + self.slots * self.slot, access=mmap.ACCESS_READ)
        except (OSError, ValueError, struct.error) as e:
            raise TwinError(f"no ring: {getattr(e, 'strerror', None) or e}", str(path), remedy) from e
        self.path = path

    def next(self) -> tuple[int, int] | None:
        """Stream and number of the block to come after the newest; None where none was written yet."""
        return _next(self._map)

    def read(self, stream: int, sequence: int) -> Block | None:
        """A block; None where it is not, not yet or not any more in the ring."""
        at = _FIRST + (sequence % self.slots) * self.slot
        length = _U32.unpack_from(self._map, at)[0]
        if not 0 < length <= self.slot - _U32.size:
            return None
        data = self._map[at + _U32.size : at + _U32.size + length]
        found = next(iter(frames(data)), None)
        if not isinstance(found, Frame) or (found.stream, found.sequence) != (stream, sequence):
            return None
        return block_of(found)

    def newest(self) -> Block | None:
        told = self.next()
        return None if told is None or told[1] == 0 else self.read(told[0], told[1] - 1)

    def replaced(self) -> bool:
        """Whether another file lies where this one lay."""
        try:
            return os.stat(self.path).st_ino != self._inode
        except OSError:
            return False

    def close(self) -> None:
        self._map.close()


def _next(data: mmap.mmap) -> tuple[int, int] | None:
    for _ in range(100):  # a torn read heals at once
        newest = data[_AT_NEWEST:_AT_CRC]
        if _U32.unpack_from(data, _AT_CRC)[0] == zlib.crc32(newest):
            stream, following = _NEWEST.unpack(newest)
            return stream, following
    return None


def _is_ring(path: Path, slots: int, slot: int) -> bool:
    try:
        with path.open("rb") as f:
            whole = os.fstat(f.fileno()).st_size == _FIRST + slots * slot
            return whole and f.read(_AT_NEWEST) == MARK + _SIZES.pack(slots, slot)
    except FileNotFoundError:
        return False
