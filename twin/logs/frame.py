"""One block as bytes, and back: the frames of `twin.logs.block_file`, without NumPy, for those who start in a moment.

Little-endian:

    4 bytes  "TWB1"
    u64 stream, u64 sequence, f64 time [s], f64 interval [s], u32 records, u16 columns, u32 length of the header text
    u32      CRC-32 of all of the above but the mark
    text     JSON [["name", "unit"], ...], UTF-8
    f64      values, records x columns, row by row
    u32      CRC-32 of text and values
"""

from __future__ import annotations

import json
import mmap
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

from twin.logs.resolver import Damaged

LATEST = 253402300800.0  # s, POSIX: the year 10000, beyond which calendars end
MARK = b"TWB1"
_HEAD = struct.Struct("<QQddIHI")
_CRC = struct.Struct("<I")
_FIRST = len(MARK) + _HEAD.size + _CRC.size  # bytes before the text


@dataclass(frozen=True)
class Frame:
    """A block whose values are bytes."""

    stream: int
    sequence: int
    time: float  # s
    interval: float  # s
    names: tuple[str, ...]
    units: tuple[str, ...]  # SI
    values: bytes  # little-endian doubles, record after record
    end_at: int = 0  # where the next frame begins in what it was read from


def packed(frame: Frame) -> bytes:
    """The bytes of a frame."""
    text = json.dumps([list(column) for column in zip(frame.names, frame.units, strict=True)]).encode()
    columns = len(frame.names)
    records = len(frame.values) // (8 * max(columns, 1))
    head = _HEAD.pack(frame.stream, frame.sequence, frame.time, frame.interval, records, columns, len(text))
    body = text + frame.values
    return MARK + head + _CRC.pack(zlib.crc32(head)) + body + _CRC.pack(zlib.crc32(body))


def frames(data: bytes | mmap.mmap, at: int = 0) -> Iterator[Frame | Damaged]:
    """The frames in a run of bytes from `at` on. What is no sound frame is one Damaged, up to the next mark that
    begins one."""
    size = len(data)
    while at < size:
        found = _frame(data, at)
        if isinstance(found, Frame):
            at = found.end_at
            yield found
            continue
        nearest = _next_frame(data, at + 1)
        yield Damaged(truncated=nearest == size and found)
        at = nearest


def _frame(data: bytes | mmap.mmap, at: int) -> Frame | bool:
    """The frame at `at`; else whether the data end within what may be a frame."""
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
    names, units = tuple(named), tuple(named.values())
    return Frame(stream, sequence, time, interval, names, units, bytes(body[length:]), end + _CRC.size)


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
