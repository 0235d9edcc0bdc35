"""Blocks of load records with a number and a time stamp, for links that carry them late, twice or not at all.

Paper 001, modules 1.03: where sampling is faster than transmission, records are grouped to blocks; the receiver checks
whether a block was read already or was lost. Here every block also carries a checksum, so that a damaged one is told
from a sound one. A stream is one run of the sender: it counts its blocks from zero, and starts another stream when it
starts anew.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from twin.errors import LogError
from twin.logs.resolver import Counts, Damaged, Resolver
from twin.logs.run import Table


@dataclass(frozen=True)
class Block:
    """Records of a cyclic log, equally spaced."""

    stream: (
        int  # of the sender's run: any number below 2**64 that differs between runs, its start time in ns for example
    )
    sequence: int  # from zero on in each stream
    time: float  # s: time stamp of the first record, POSIX, or since the start of the log
    interval: float  # s between records, T_core
    names: tuple[str, ...]
    units: tuple[str, ...]  # SI
    values: np.ndarray  # (n_records, n_columns), NaN where a value is missing

    @property
    def end(self) -> float:
        """When its last record ceases to hold [s]."""
        return self.time + self.interval * len(self.values)

    @property
    def records(self) -> int:
        return len(self.values)

    def without(self, n: int) -> Block:
        """The block without its first n records."""
        return replace(self, time=self.time + n * self.interval, values=self.values[n:])


@dataclass(frozen=True)
class Resolved:
    """Records in order of time."""

    table: Table  # a gap is one row of NaN at its start: nothing is invented
    gaps: np.ndarray  # (k, 2) s: starts and ends of what is missing
    counts: Counts


def group(
    records: Iterable[np.ndarray],
    names: Sequence[str],
    units: Sequence[str],
    start: float,
    interval: float,
    size: int = 1000,
    stream: int = 0,
) -> Iterator[Block]:
    """Records, in arrays (any, n_columns), as blocks of `size` records; the last may be shorter.

    start [s]: time of the first record; interval [s]: T_core. Raises LogError where columns, names and units differ in
    number.
    """
    if len(names) != len(units) or len(set(names)) != len(names):
        raise LogError("names and units do not match, or a name appears twice", "blocks", "give one unit per column")
    sequence, waiting, held = 0, list[np.ndarray](), 0

    def block(values: np.ndarray) -> Block:
        time = start + sequence * size * interval
        return Block(stream, sequence, time, interval, tuple(names), tuple(units), values)

    for chunk in records:
        if chunk.ndim != 2 or chunk.shape[1] != len(names):
            raise LogError(f"records of shape {chunk.shape} for {len(names)} columns", "blocks", "one column per name")
        waiting.append(np.asarray(chunk, dtype=float))
        held += len(chunk)
        if held >= size:
            whole = np.vstack(waiting)
            for _ in range(held // size):
                yield block(whole[:size])
                whole, sequence = whole[size:], sequence + 1
            waiting, held = [whole], len(whole)
    if held:
        yield block(np.vstack(waiting))


def in_order(arrivals: Iterable[Block | Damaged], resolver: Resolver) -> Iterator[Block]:
    """Blocks as the resolver lets them go, the rest at the end; its counts are complete then."""
    for arrival in arrivals:
        yield from resolver.push(arrival)
    yield from resolver.finish()


def tables(blocks: Iterable[Block], zero: float = 0.0) -> Iterator[Table]:
    """Blocks, as a Resolver lets them go, as pieces of one log, times since `zero` [s]; gaps start with a row of NaN.

    Raises LogError where the columns change.
    """
    before: Block | None = None
    for block in blocks:
        if before is not None and (block.names, block.units) != (before.names, before.units):
            raise LogError(
                f"block {block.sequence} has other columns than block {before.sequence}",
                "blocks",
                "start another file where the channels change",
            )
        values, time = block.values, block.time - zero + block.interval * np.arange(len(block.values))
        if before is not None and (gap := gap_between(before, block)) is not None:
            time = np.append(gap[0] - zero, time)
            values = np.vstack([np.full((1, values.shape[1]), np.nan), values])
        columns = {name: values[:, k] for k, name in enumerate(block.names)}
        yield Table(time, columns, dict(zip(block.names, block.units, strict=True)))
        before = block


def resolve(arrivals: Iterable[Block | Damaged], window: int | None = None, first: int | None = 0) -> Resolved:
    """All that arrived as one log, in order of the blocks' numbers whatever the order of arrival, and the counts.

    window, first: as in `Resolver`. Raises LogError where nothing sound arrived, or the columns change.
    """
    resolver: Resolver[Block] = Resolver(window, first)
    blocks = list(in_order(arrivals, resolver))
    if not blocks:
        raise LogError(f"no sound block ({resolver.counts})", "blocks", "check the sender")
    parts = list(tables(blocks))
    columns = {name: np.concatenate([p.columns[name] for p in parts]) for name in parts[0].columns}
    gaps = [gap for a, b in pairwise(blocks) if (gap := gap_between(a, b)) is not None]
    table = Table(np.concatenate([p.time for p in parts]), columns, parts[0].units)
    return Resolved(table, np.array(gaps).reshape(-1, 2), resolver.counts)


def gap_between(before: Block, block: Block) -> tuple[float, float] | None:
    """Start and end [s] of the time between two blocks without a record; None where stamps are off by less than half a
    record."""
    return (before.end, block.time) if block.time - before.end > 0.5 * before.interval else None
