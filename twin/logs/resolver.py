"""Blocks put in order by their numbers as they arrive: what is lost, repeated, reordered, late or damaged is counted.

Knows of a block only its number and its time, so that blocks of any kind of records go through it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Generic, Protocol, TypeVar

LEAP = 10**6  # blocks: 11 days of blocks of one second. A number further away than that from all others is an error
# Streams that are over, and stretches of lost numbers in one, that are remembered: what arrives of older ones counts as
# repeated, not as late. Memory is bounded with it.
REMEMBERED = 1000


class Numbered(Protocol):
    """What a block must tell of itself."""

    @property
    def stream(self) -> int: ...  # of the sender's run

    @property
    def sequence(self) -> int: ...  # from zero on in each stream

    @property
    def time(self) -> float: ...  # s, time stamp of the first record

    @property
    def interval(self) -> float: ...  # s between records

    @property
    def records(self) -> int: ...

    @property
    def end(self) -> float: ...  # s, when its last record ceases to hold

    def without(self: B, n: int) -> B: ...  # the block without its first n records


B = TypeVar("B", bound=Numbered)


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
class Resolver(Generic[B]):
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
    keep_overlaps: bool = False  # let records out whose time has been given: for who keeps a clock of their own
    _stream: int | None = None
    _numbers: _Numbers = field(default_factory=_Numbers)
    _over: dict[int, _Numbers] = field(default_factory=dict)
    _waiting: dict[int, B] = field(default_factory=dict)
    _leapt: B | None = None  # the last whose number was too far away
    _given: B | None = None  # the last that went out

    def push(self, arrival: B | Damaged) -> list[B]:
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
        out: list[B] = []
        if self._stream is None:
            self._begin(arrival.stream, s if self.first is None else self.first)
        elif arrival.stream != self._stream:
            out = self.finish()
            self._over[self._stream] = self._numbers
            while len(self._over) > REMEMBERED:
                del self._over[next(iter(self._over))]
            self._count(restarts=1)
            self._begin(arrival.stream, 0)
        return out + (self._leap(arrival) if self._numbers.far(s) else self._take(arrival))

    @property
    def stream(self) -> int:
        """The stream that is read; 0 before the first arrival."""
        return self._stream or 0

    @property
    def waiting(self) -> int:
        """Blocks that wait for missing ones."""
        return len(self._waiting)

    def held(self) -> tuple[B, ...]:
        """Blocks that have arrived and neither gone out nor been left out for good."""
        return (*self._waiting.values(), *(() if self._leapt is None else (self._leapt,)))

    def go_on(self, stream: int, following: int) -> None:
        """Before the first arrival: everything of a stream below the number `following` has been given before."""
        self._begin(stream, following)

    def missing(self) -> tuple[int, ...]:
        """Numbers that later blocks wait for."""
        numbers = self._numbers
        return tuple(s for s in range(numbers.next, numbers.largest) if s not in self._waiting)

    def finish(self) -> list[B]:
        """What still waits, in order; what is missing in between is lost."""
        out: list[B] = []
        for s in sorted(self._waiting):
            self._give_up(s)
            out += self._go(s)
        return out

    def _begin(self, stream: int, first: int) -> None:
        self._stream, self._numbers, self._leapt = stream, _Numbers(first, first), None

    def _leap(self, block: B) -> list[B]:
        """Counts from elsewhere once a second number says so."""
        before, self._leapt = self._leapt, block
        if before is None or not 0 < abs(before.sequence - block.sequence) <= LEAP:
            self._count(damaged=1)
            return []
        out = self.finish()
        self._count(damaged=-1, restarts=int(self._numbers.largest >= 0))
        self._begin(block.stream, min(before.sequence, block.sequence))
        return out + self._take(before) + self._take(block)

    def _take(self, block: B) -> list[B]:
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

    def _due(self) -> list[B]:
        out: list[B] = []
        numbers = self._numbers
        while self._waiting:
            if numbers.next in self._waiting:
                out += self._go(numbers.next)
            elif self.window is not None and numbers.largest - numbers.next >= self.window:
                self._give_up(min(min(self._waiting), numbers.largest - self.window + 1))
            else:
                break
        return out

    def _go(self, s: int) -> list[B]:
        """A waiting block, without the records whose time has been given; none where nothing is left of it."""
        block, before = self._waiting.pop(s), self._given
        self._numbers.next = s + 1
        self._count(delivered=1)
        again = (
            (before.end - 0.5 * before.interval - block.time) / block.interval
            if before is not None and not self.keep_overlaps
            else 0.0
        )
        if again > 0.0:
            n = math.ceil(min(again, block.records))
            self._count(overlapping=n)
            block = block.without(n)
        if not block.records:
            return []
        self._given = block
        return [block]

    def _give_up(self, until: int) -> None:
        """Everything from the next number up to `until`, exclusive, is lost."""
        numbers = self._numbers
        if until > numbers.next:
            numbers.lost.append(range(numbers.next, until))
            del numbers.lost[:-REMEMBERED]
            self._count(lost=until - numbers.next)
            numbers.next = until

    def _count(self, **more: int) -> None:
        self.counts = replace(self.counts, **{k: getattr(self.counts, k) + n for k, n in more.items()})
