"""A block of load records as the process beside the machine holds it: flat doubles, without NumPy.

NumPy takes a tenth of a second and 20 MB to load, which is most of what the C engine is to stay below.
"""

from __future__ import annotations

import sys
from array import array
from collections.abc import Iterable
from dataclasses import dataclass, replace

from twin.logs.frame import Frame
from twin.logs.resolver import Damaged


@dataclass(frozen=True)
class Block:
    """Records of a cyclic log, equally spaced."""

    stream: int  # of the sender's run: below 2**64, another one whenever it starts to count anew
    sequence: int  # from zero on in each stream
    time: float  # s: time stamp of the first record, POSIX, or since the start of the log
    interval: float  # s between records, > 0
    names: tuple[str, ...]
    units: tuple[str, ...]  # SI
    values: array[float]  # doubles (records * columns), record after record; NaN where a value is missing

    @property
    def records(self) -> int:
        return len(self.values) // len(self.names)

    @property
    def end(self) -> float:
        """When its last record ceases to hold [s]."""
        return self.time + self.interval * self.records

    def without(self, n: int) -> Block:
        """The block without its first n records."""
        return replace(self, time=self.time + n * self.interval, values=self.values[n * len(self.names) :])


def frame_of(block: Block) -> Frame:
    """The block as bytes."""
    return Frame(block.stream, block.sequence, block.time, block.interval, block.names, block.units,
                 _little(block.values).tobytes())  # fmt: skip


def block_of(frame: Frame) -> Block:
    """The inverse of `frame_of`."""
    values = array("d")
    values.frombytes(frame.values)
    return Block(frame.stream, frame.sequence, frame.time, frame.interval, frame.names, frame.units, _little(values))


def blocks_of(found: Iterable[Frame | Damaged]) -> Iterable[Block | Damaged]:
    """Frames as blocks; what is damaged stays so."""
    return (f if isinstance(f, Damaged) else block_of(f) for f in found)


def _little(values: array[float]) -> array[float]:
    if sys.byteorder == "big":
        values = values[:]
        values.byteswap()
    return values
