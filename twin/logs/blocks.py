"""Blocks of load records with a number and a time stamp, for links that carry them late, twice or not at all.

Paper 001, modules 1.03: where sampling is faster than transmission, records are grouped to blocks; the receiver checks
whether a block was read already or was lost. Here every block also carries a checksum, so that a damaged one is told
from a sound one. A stream is one run of the sender: it counts its blocks from zero, and starts another stream when it
starts anew.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from twin.errors import LogError
from twin.logs.run import Table

LEAP = 10**6  # blocks: 11 days of blocks of one second. A number further away than that from all others is an error


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


@dataclass(frozen=True)
class Damaged:
    """What arrived and was no sound block."""

    truncated: bool = False  # the end of a file that was being written


@dataclass(frozen=True)
class Counts:
    """What happened to blocks on their way. delivered + lost is all that the sender numbered, up to the last seen."""

    delivered: int = 0  # in time, once each
    lost: int = 0  # never delivered, or too late
    repeated: int = 0  # arrivals of what was read already
    reordered: int = 0  # delivered after a later one had arrived
    late: int = 0  # arrivals of what had been given up as lost
    damaged: int = 0  # arrivals that were no sound block; their blocks are lost unless they come again
    truncated: int = 0  # of the damaged, ends of files
    restarts: int = 0  # further streams, and leaps of the numbers within one
    overlapping: int = 0  # records of the delivered that were left out: their time had been given already

    def __str__(self) -> str:
        of_blocks = [k for k in self.__dataclass_fields__ if k != "overlapping"]
        told = ", ".join(f"{getattr(self, k)} {k}" for k in of_blocks if k == "delivered" or getattr(self, k))
        n = self.overlapping
        return f"blocks: {told}" + (f"; {n} overlapping record{'s' * (n > 1)} left out" if n else "")


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


@dataclass
class _Numbers:
    """Which numbers of a stream have gone out or were given up: all from `start` on that are below `next`."""

    start: int = 0  # of counting
    next: int = 0  # number of the next block to go out
    largest: int = -1  # seen
    lost: list[range] = field(default_factory=list)

    def given_up(self, s: int) -> bool:
        return s < self.start or any(s in numbers for numbers in self.lost)

    def far(self, s: int) -> bool:
        return not self.start - LEAP <= s <= max(self.next, self.largest) + LEAP


@dataclass
class Resolver:
    """Puts blocks in order as they arrive; a missing one is given up when one `window` numbers later has arrived.

    window None: nothing is given up before `finish`. Memory is bounded by the window. A stream that another has
    followed is over: what still arrives of it is repeated or late.

    A number that leaps by more than LEAP counts as damaged, and nothing as lost, unless another one near it arrives
    too: then the sender does count there. Both are taken, and counting starts again from the smaller one.

    Stamps of what goes out increase, whatever the clock of the sender does: records less than half an interval after
    the last one given are left out and counted. So after a clock was set back the log goes on where it had been.
    """

    window: int | None = 16
    first: int | None = 0  # number of the first block expected; None: that of the first arrival, to join in midstream
    counts: Counts = Counts()
    _stream: int | None = None
    _numbers: _Numbers = field(default_factory=_Numbers)
    _over: dict[int, _Numbers] = field(default_factory=dict)
    _waiting: dict[int, Block] = field(default_factory=dict)
    _leapt: Block | None = None  # the last whose number was too far away
    _given: Block | None = None  # the last that went out

    def push(self, arrival: Block | Damaged) -> list[Block]:
        """Blocks that may go out now, in order."""
        if isinstance(arrival, Damaged):
            self._count(damaged=1, truncated=int(arrival.truncated))
            return []
        s = arrival.sequence
        if arrival.stream in self._over:
            over = self._over[arrival.stream]
            had = s < over.next and not over.given_up(s)
            self._count(repeated=int(had), late=int(not had))
            return []
        out: list[Block] = []
        if self._stream is None:
            self._begin(arrival.stream, s if self.first is None else self.first)
        elif arrival.stream != self._stream:
            out = self.finish()
            self._over[self._stream] = self._numbers
            self._count(restarts=1)
            self._begin(arrival.stream, 0)
        return out + (self._leap(arrival) if self._numbers.far(s) else self._take(arrival))

    def finish(self) -> list[Block]:
        """What still waits, in order; what is missing in between is lost."""
        out: list[Block] = []
        for s in sorted(self._waiting):
            self._give_up(s)
            out += self._go(s)
        return out

    def _begin(self, stream: int, first: int) -> None:
        self._stream, self._numbers, self._leapt = stream, _Numbers(first, first), None

    def _leap(self, block: Block) -> list[Block]:
        """Counts from elsewhere once a second number says so."""
        before, self._leapt = self._leapt, block
        if before is None or not 0 < abs(before.sequence - block.sequence) <= LEAP:
            self._count(damaged=1)
            return []
        out = self.finish()
        self._count(damaged=-1, restarts=int(self._numbers.largest >= 0))
        self._begin(block.stream, min(before.sequence, block.sequence))
        return out + self._take(before) + self._take(block)

    def _take(self, block: Block) -> list[Block]:
        s, numbers = block.sequence, self._numbers
        if numbers.given_up(s):
            self._count(late=1)
        elif s < numbers.next or s in self._waiting:
            self._count(repeated=1)
        else:
            self._count(reordered=int(s < numbers.largest))
            numbers.largest = max(numbers.largest, s)
            self._waiting[s] = block
        return self._due()

    def _due(self) -> list[Block]:
        out: list[Block] = []
        numbers = self._numbers
        while self._waiting:
            if numbers.next in self._waiting:
                out += self._go(numbers.next)
            elif self.window is not None and numbers.largest - numbers.next >= self.window:
                self._give_up(min(min(self._waiting), numbers.largest - self.window + 1))
            else:
                break
        return out

    def _go(self, s: int) -> list[Block]:
        """A waiting block, without the records whose time has been given; none where nothing is left of it."""
        block, before = self._waiting.pop(s), self._given
        self._numbers.next = s + 1
        self._count(delivered=1)
        again = (before.end - 0.5 * before.interval - block.time) / block.interval if before is not None else 0.0
        if again > 0.0:
            n = math.ceil(min(again, len(block.values)))
            self._count(overlapping=n)
            block = replace(block, time=block.time + n * block.interval, values=block.values[n:])
        if not len(block.values):
            return []
        self._given = block
        return [block]

    def _give_up(self, until: int) -> None:
        """Everything from the next number up to `until`, exclusive, is lost."""
        numbers = self._numbers
        if until > numbers.next:
            numbers.lost.append(range(numbers.next, until))
            self._count(lost=until - numbers.next)
            numbers.next = until

    def _count(self, **more: int) -> None:
        self.counts = replace(self.counts, **{k: getattr(self.counts, k) + n for k, n in more.items()})


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
    resolver = Resolver(window, first)
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
