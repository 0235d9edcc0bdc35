"""Blocks in a file that is only ever appended to: a crash costs the block that was being written, and no other.

One frame per block, little-endian:

    4 bytes  "TWB1"
    u64 stream, u64 sequence, f64 time [s], f64 interval [s], u32 records, u16 columns, u32 length of the header text
    u32      CRC-32 of all of the above but the mark
    text     JSON [["name", "unit"], ...], UTF-8
    f64      values, records x columns, row by row
    u32      CRC-32 of text and values

Every frame names its columns, so that a file can be read from any frame on, and after a damaged one.
"""

from __future__ import annotations

import json
import mmap
import os
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from twin.errors import LogError
from twin.logs.blocks import Block, Damaged
from twin.ordinary import ordinary

LATEST = 253402300800.0  # s, POSIX: the year 10000, beyond which calendars end
MARK = b"TWB1"
_HEAD = struct.Struct("<QQddIHI")
_CRC = struct.Struct("<I")
_FIRST = len(MARK) + _HEAD.size + _CRC.size  # bytes before the text


def encode(block: Block) -> bytes:
    """The frame of a block."""
    values = np.ascontiguousarray(block.values, dtype="<f8")
    text = json.dumps([list(column) for column in zip(block.names, block.units, strict=True)]).encode()
    head = _HEAD.pack(block.stream, block.sequence, block.time, block.interval, len(values), values.shape[1], len(text))
    body = text + values.tobytes()
    return MARK + head + _CRC.pack(zlib.crc32(head)) + body + _CRC.pack(zlib.crc32(body))


def decode(data: bytes | mmap.mmap) -> Iterator[Block | Damaged]:
    """The blocks in a run of bytes. What is no sound frame is one Damaged, up to the next mark that begins one."""
    at, size = 0, len(data)
    while at < size:
        found = _frame(data, at)
        if isinstance(found, tuple):
            block, at = found
            yield block
            continue
        nearest = _next_frame(data, at + 1)
        yield Damaged(truncated=nearest == size and found)
        at = nearest


def append(path: Path, block: Block) -> None:
    """Add a block to a file, by one write, on the disk when this returns. Raises LogError where that fails."""
    try:
        with Path(path).open("ab", buffering=0) as f:
            f.write(encode(block))
            os.fsync(f.fileno())
    except OSError as e:
        raise LogError(f"cannot write: {e.strerror or e}", str(path), "free disk space or choose another file") from e


def read_blocks(path: Path) -> Iterator[Block | Damaged]:
    """The blocks of a file as they stand in it, in bounded memory. Raises LogError where it is no file of blocks."""
    path = Path(path)
    try:
        with ordinary(path).open("rb") as f:
            if os.fstat(f.fileno()).st_size == 0:
                raise LogError("the file is empty", str(path), "log at least one block")
            with mmap.mmap(f.fileno(), 0, access=mmap.ACCESS_READ) as data:
                if data.find(MARK) < 0:
                    raise LogError(
                        "holds no blocks",
                        str(path),
                        "give a file of load blocks; docs/load_blocks.md has the format",
                    )
                yield from decode(data)
    except OSError as e:
        raise LogError(f"cannot read: {e.strerror or e}", str(path), "check the path and its permissions") from e


def _frame(data: bytes | mmap.mmap, at: int) -> tuple[Block, int] | bool:
    """The block at `at` and where the next begins; else whether the data end within what may be a frame."""
    if data[at : at + len(MARK)] != MARK[: len(data) - at]:
        return False
    head = data[at + len(MARK) : at + len(MARK) + _HEAD.size]
    crc = data[at + len(MARK) + _HEAD.size : at + _FIRST]
    if len(crc) < _CRC.size:
        return True
    if _CRC.unpack(crc)[0] != zlib.crc32(head):
        return False
    stream, sequence, time, interval, records, columns, length = _HEAD.unpack(head)
    end = at + _FIRST + length + 8 * records * columns
    body, crc = data[at + _FIRST : end], data[end : end + _CRC.size]
    if len(crc) < _CRC.size:
        return True
    if _CRC.unpack(crc)[0] != zlib.crc32(body):
        return False
    named = _columns(body[:length])
    timed = abs(time) < LATEST and 0.0 < interval * records < LATEST - time
    if not (records and columns and columns == len(named) and timed):
        return False
    values = np.frombuffer(body, dtype="<f8", offset=length).reshape(records, columns).astype(float)
    return Block(stream, sequence, time, interval, tuple(named), tuple(named.values()), values), end + _CRC.size


def _columns(text: bytes) -> dict[str, str]:
    """Units by name; none where a sender does not keep to the format, though its checksums are right."""
    try:
        pairs = json.loads(text)
        if not all(len(pair) == 2 and isinstance(pair, list) for pair in pairs):
            return {}
        named = {name: unit for name, unit in pairs if name.isprintable() and unit.isprintable()}
    except (ValueError, TypeError, AttributeError, RecursionError):
        return {}
    return named if len(named) == len(pairs) else {}


def _next_frame(data: bytes | mmap.mmap, at: int) -> int:
    """Where the next sound head of a frame begins, else the end of the data."""
    while (at := data.find(MARK, at)) >= 0:
        head = data[at + len(MARK) : at + len(MARK) + _HEAD.size]
        crc = data[at + len(MARK) + _HEAD.size : at + _FIRST]
        if len(crc) == _CRC.size and _CRC.unpack(crc)[0] == zlib.crc32(head):
            return at
        at += 1
    return len(data)
