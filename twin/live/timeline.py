"""Time of the machine out of the clock of a sender, which may leap: it never goes back, and a gap stays a gap.

Rules, for the first record of a block against what was to come next:

- as stamped, within half an interval; where records are not numbered, up to ten times the last spacing later.
- later: a gap. Values hold through it (a row without values marks its start). If the numbers of the blocks show that
  none is missing and the stamp is later by more than LEAP, the clock was set: time goes on where it was.
- later by more than LONGEST: the clock was set, whatever the numbers say.
- earlier by more than LEAP, or at all in another stream: the clock was set back, time goes on where it was.
- earlier by less: records whose time has been are left out.

What comes out depends on the records alone, not on how those without numbers were grouped to blocks.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

from twin.live.block import Block

LEAP = 60.0  # s: more than clocks that are disciplined by NTP or PTP are ever stepped by while a machine runs
LONGEST = 7 * 86400.0  # s: after a week at rest every machine tool is as warm as its hall: it is to be started afresh
PAUSE = 10.0  # spacings that a log without numbers may pause for


@dataclass
class Timeline:
    """Places blocks on the time since the first record [s]; plain numbers, so that it can be stored."""

    origin: float = 0.0  # s: stamp of the first record
    shift: float = 0.0  # s: added to stamps since
    last: float = -1.0  # s since the first record: time of the last one placed; below zero: none yet
    spacing: float = 0.0  # s: until the next one is to come; 0: not known
    stream: int = 0
    sequence: int = -1
    leaps: int = 0  # of the clock
    gaps: int = 0
    held: float = 0.0  # s in gaps
    left_out: int = 0  # records

    @property
    def end(self) -> float:
        """When the next record is to come [s]."""
        return self.last + self.spacing

    def place(self, block: Block, numbered: bool) -> tuple[Block, float, float | None]:
        """The block without records that are left out, its time [s since the first record], and where a gap begins.

        numbered: the numbers of the blocks show whether one is missing, and their intervals are what they say.
        """
        if self.last < 0.0:
            self.origin, self.last = block.time, 0.0
            self._went(block, 0.0, numbered)
            return block, 0.0, None
        begin = block.time - self.origin + self.shift
        late = begin - self.end
        small = 0.5 * block.interval if numbered else PAUSE * self.spacing
        complete = numbered and block.stream == self.stream and block.sequence == self.sequence + 1
        gap = None
        if self._was_set(block, begin, late, complete):
            self.leaps += 1
            begin = self.end if self.spacing else self.last + block.interval
            self.shift = begin - (block.time - self.origin)
        elif late > small and self.spacing:
            self.gaps += 1
            self.held += late
            gap = self.end
        spacing = self.spacing
        while block.records and begin <= self.last:
            self.left_out += 1
            block, begin = block.without(1), begin + block.interval
        if block.records:
            if not numbered and gap is None:
                self.spacing = begin - self.last
            self._went(block, begin, numbered)
            self.spacing = spacing if gap is not None and block.records == 1 and not numbered else self.spacing
        self.stream, self.sequence = block.stream, block.sequence
        return block, begin, gap

    def _was_set(self, block: Block, begin: float, late: float, complete: bool) -> bool:
        """Whether the sender's clock was set."""
        back = self.last - begin
        other = block.stream != self.stream
        return late > LONGEST or (complete and late > LEAP) or back > LEAP or (other and back >= 0.0)

    def _went(self, block: Block, begin: float, numbered: bool) -> None:
        self.last = begin + (block.records - 1) * block.interval
        if numbered or block.records > 1:
            self.spacing = block.interval
        self.stream, self.sequence = block.stream, block.sequence

    def stored(self) -> dict[str, float | int]:
        return asdict(self)
