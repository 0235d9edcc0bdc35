"""A file of load blocks as a run."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from twin.errors import LogError
from twin.logs.block_file import read_blocks
from twin.logs.blocks import Block, gap_between, in_order, tables
from twin.logs.compress import compress_stream
from twin.logs.resolver import Counts, Resolver
from twin.logs.run import Run, Table
from twin.units import parse_unit

EPOCH = 1e8  # s: time stamps above it are POSIX (after March 1973), others count from the start of the log


def unpack(path: Path, mean: float | None = None, machine: str | None = None) -> tuple[Run, Counts, int]:
    """The run, what happened to its blocks, and the number of gaps.

    mean [s]: compress to means over this time as the blocks are read, in memory that does not grow with their number.
    The last interval may be shorter; a closing row stands where the last record ceases to hold.
    Raises LogError: no file of blocks, nothing sound in it, columns that change or with units unknown, a log shorter
    than `mean`, records further apart than `mean`.
    """
    resolver: Resolver[Block] = Resolver(window=None)
    blocks = in_order(read_blocks(path), resolver)
    first = next(blocks, None)
    if first is None:
        raise LogError(f"no sound block ({resolver.counts})", str(path), "check the sender, and the disk")
    _check_units(first, path)
    absolute = first.time > EPOCH
    gaps, before = 0, first

    def watched() -> Iterator[Block]:
        nonlocal gaps, before
        _check_mean(first, mean, path)
        yield first
        for block in blocks:
            _check_mean(block, mean, path)
            gaps += gap_between(before, block) is not None
            before = block
            yield block

    parts = tables(watched(), first.time if absolute else 0.0)
    log = list(parts if mean is None else compress_stream(parts, mean, lambda: before.interval))
    if not log:
        raise LogError(f"the log is shorter than {mean:g} s", str(path), "give a shorter --mean")
    columns = {name: np.concatenate([piece.columns[name] for piece in log]) for name in log[0].columns}
    time = np.concatenate([piece.time for piece in log])
    usual = mean is None or abs(float(np.median(np.diff(time))) - mean) < 0.05 * mean  # not of an interval and a half
    said = f"unpacked from {path.name}; {resolver.counts}" + (f"; {gaps} gap{'s' * (gaps > 1)}" if gaps else "")
    run = Run(
        loads=Table(time, columns, log[0].units),
        start=datetime.fromtimestamp(first.time, UTC) if absolute else None,
        sampling=(mean or first.interval) if usual else None,
        provenance=said + (f"; means over {mean:g} s: rms, mean of magnitudes" if mean else ""),
        machine=machine,
    )
    return run, resolver.counts, gaps


def _check_mean(block: Block, mean: float | None, path: Path) -> None:
    if mean is not None and mean < block.interval * (1.0 - 1e-9):
        what = f"means over {mean:g} s of records {block.interval:g} s apart"
        raise LogError(what, str(path), f"write --mean '{block.interval:g} s' or longer, or leave --mean out")


def _check_units(block: Block, path: Path) -> None:
    for name, unit in zip(block.names, block.units, strict=True):
        try:
            si = parse_unit(unit).si
        except ValueError as e:
            raise LogError(f"column '{name}': {e}", str(path), "the sender must name an SI unit") from e
        if si != unit:
            raise LogError(f"column '{name}' is in '{unit}', not SI", str(path), f"send it in {si}")
