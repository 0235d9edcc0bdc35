"""Blocks in a file that is only ever appended to: a crash costs the block that was being written, and no other.

One frame (`twin.logs.frame`) per block. Every frame names its columns, so that a file can be read from any frame on,
and after a damaged one.
"""

from __future__ import annotations

import mmap
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from twin.errors import LogError
from twin.logs.blocks import Block
from twin.logs.frame import MARK, Frame, frames, packed
from twin.logs.resolver import Damaged
from twin.ordinary import ordinary


def encode(block: Block) -> bytes:
    """The frame of a block."""
    values = np.ascontiguousarray(block.values, dtype="<f8").tobytes()
    return packed(Frame(block.stream, block.sequence, block.time, block.interval, block.names, block.units, values))


def decode(data: bytes | mmap.mmap) -> Iterator[Block | Damaged]:
    """The blocks in a run of bytes. What is no sound frame is one Damaged, up to the next mark that begins one."""
    for f in frames(data):
        yield f if isinstance(f, Damaged) else _block(f)


def _block(f: Frame) -> Block:
    values = np.frombuffer(f.values, dtype="<f8").reshape(-1, len(f.names)).astype(float)
    return Block(f.stream, f.sequence, f.time, f.interval, f.names, f.units, values)


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
