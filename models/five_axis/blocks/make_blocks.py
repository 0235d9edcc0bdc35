"""Writes shift.twb: an hour of experiment A as a control would send it, one block lost, two in the wrong order."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from twin.logs.block_file import append
from twin.logs.blocks import Block
from twin.logs.read import read_run

HERE = Path(__file__).parent
RECORDS, INTERVAL = 6, 10.0  # of a block; s between them
LOST, LATE = 30, 45  # block that never arrives, block that arrives after the next one


def main() -> None:
    loads = read_run(HERE.parent / "runs" / "experiment_a").loads
    names = tuple(loads.columns)
    values = np.column_stack([loads.columns[n] for n in names])
    order = [k for k in range(round(3600 / INTERVAL / RECORDS)) if k != LOST]
    at = order.index(LATE)
    order[at : at + 2] = [LATE + 1, LATE]
    path = HERE / "shift.twb"
    path.unlink(missing_ok=True)
    for k in order:
        rows = slice(k * RECORDS, (k + 1) * RECORDS)
        append(path, Block(stream=1, sequence=k, time=float(loads.time[rows][0]), interval=INTERVAL, names=names,
                           units=tuple(loads.units[n] for n in names), values=values[rows]))  # fmt: skip


if __name__ == "__main__":
    main()
