"""The sender of `benchmarks.live`: writes a run folder's rows to a ring as blocks, paced, from where the ring ends.

It stands for a control with its log behind it: killed and started again, it goes on after the newest block.
Usage: python -m benchmarks.live_sender LOADS.CSV RING ROWS_PER_BLOCK SPEED BEGAN(monotonic s)
"""

from __future__ import annotations

import sys
import time
from array import array
from pathlib import Path

from twin.live.block import Block
from twin.live.csv_rows import GrowingFile
from twin.live.ring import RingWriter

STREAM = 27


def blocks(path: Path, group: int) -> list[Block]:
    """Equally spaced rows of a loads.csv in blocks of `group`."""
    file = GrowingFile(path)
    rows = []
    while lines := file.lines(10_000):
        header = file.header
        assert header is not None
        rows += [row for line in lines if (row := header.row(line)) is not None]
    interval = rows[1][0] - rows[0][0]
    return [
        Block(STREAM, k, 1.8e9 + rows[k * group][0], interval, header.names, header.units,
              array("d", [v for _, row in rows[k * group : (k + 1) * group] for v in row]))
        for k in range(len(rows) // group)
    ]  # fmt: skip


def main() -> None:
    path, ring, group, speed, began = sys.argv[1:]
    sent = blocks(Path(path), int(group))
    writer = RingWriter(Path(ring), slots=512, slot=1 << 14)
    told = writer.next()
    for block in sent[told[1] if told and told[0] == STREAM else 0 :]:
        due = float(began) + (block.time - sent[0].time) / float(speed)
        time.sleep(max(due - time.monotonic(), 0.0))
        writer.write(block)


if __name__ == "__main__":
    main()
