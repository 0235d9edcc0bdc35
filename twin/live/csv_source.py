"""Blocks from CSV files: one that grows, or a recorded run at any speed.

A row is a block of its own, or, where many wait, equally spaced ones are one block: only where times are whole numbers
of 1/1024 s, with which sums are exact, so that what is computed does not depend on how rows were grouped.
"""

from __future__ import annotations

import math
import time as clock
import zlib
from array import array
from collections.abc import Sequence
from pathlib import Path

from twin.errors import LogError
from twin.live.block import Block
from twin.live.csv_rows import GrowingFile
from twin.live.source import Mark
from twin.logs.resolver import Damaged

MOST = 1000  # rows in a block
LOOK = 0.2  # s between two looks at a file


class CsvSource:
    """Rows of a file, as they are appended; speed > 0: paced by their times, 0: as they are there."""

    numbered = False

    def __init__(self, path: Path, beside: Path | None = None, speed: float = 1.0, paced: bool = False):
        """beside: another CSV file whose columns join the rows, each with the last value before. Raises LogError."""
        self.speed, self.paced, self.ended = speed, paced, False
        self._file, self._beside = GrowingFile(path), None if beside is None else GrowingFile(beside)
        if paced and not path.is_file():
            raise LogError("no such file", str(path), "give a run folder with loads.csv, or csv:FILE for one to come")
        self._mark: Mark | None = None  # the last row in the journal
        self._stream = 0
        self._interval = 0.0  # s, between the last two rows; 0: there were no two yet, and the first one waits
        self._before = -math.inf  # s, time of the last row
        self._waiting: list[tuple[float, list[float]]] = []  # of the file beside
        self._joined: list[float] = []
        self._ahead: list[tuple[int, float, list[float]]] = []  # rows read and not given: number, time, values
        self._begun: tuple[float, float] | None = None  # time of a row, and when it was due

    def resume(self, mark: Mark | None) -> None:
        self._mark = mark

    def fetch(self, stream: int, numbers: Sequence[int]) -> Sequence[Block]:
        return ()

    def release(self, held: Sequence[Block]) -> None:
        return

    @property
    def error(self) -> str:
        return "" if self._file.path.is_file() else f"there is no file {self._file.path} yet"

    def poll(self, wait: float) -> Sequence[Block | Damaged]:
        until = clock.monotonic() + wait
        while True:
            bad = [] if self._ahead and self._interval else self._read_counted()
            due = self._due()
            if due or bad:
                return [*bad, *due]
            if self.ended or clock.monotonic() >= until:
                return []
            clock.sleep(max(min(self._pause(), until - clock.monotonic()), 0.0005))

    def close(self) -> None:
        return

    def _read_counted(self) -> list[Damaged]:
        before = self._file.line
        got = self._read()
        if self.paced and not got and self._file.line == before:
            self.ended = True
        return [Damaged()] * (self._file.line - before - got) if self._file.line >= before else []

    def _read(self) -> int:
        """Take rows from the file; how many are sound."""
        number = self._file.line
        lines = self._file.lines(MOST)
        header = self._file.header
        if header is None:
            return 0
        first = self._file.line - len(lines)
        if first != number or not self._stream:
            self._stream = 0
        sound = 0
        for k, line in enumerate(lines):
            row = header.row(line)
            if row is None:
                continue
            if not self._stream:  # of the columns and the first time: another file is another stream
                self._stream = zlib.crc32(repr((header.names, row[0])).encode()) or 1
            sound += 1
            apart = row[0] - self._before
            if 0.0 < apart < math.inf:
                self._interval = apart
            self._before = row[0]
            if self._known(first + k):
                continue
            self._ahead.append((first + k, row[0], row[1] + self._at_side(row[0])))
        return sound

    def _known(self, number: int) -> bool:
        """Whether a row of the file is in the journal."""
        mark = self._mark
        return mark is not None and mark.stream == self._stream and number <= mark.sequence

    def _at_side(self, time: float) -> list[float]:
        if self._beside is None:
            return []
        while True:
            if not self._waiting:
                lines = self._beside.lines(MOST)
                header = self._beside.header
                if header is None:
                    return []
                self._waiting = [row for line in lines if (row := header.row(line)) is not None]
                self._joined = self._joined or [math.nan] * len(self._kept())
            if not self._waiting or self._waiting[0][0] > time:
                return self._joined
            values = self._waiting.pop(0)[1]
            self._joined = [values[k] for k in self._kept()]

    def _kept(self) -> list[int]:
        """Columns beside that the loads do not have: a block with two of one name could not be read again."""
        own, beside = self._file.header, self._beside.header if self._beside else None
        if own is None or beside is None:
            return []
        return [k for k, name in enumerate(beside.names) if name not in own.names]

    def _names(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        header = self._file.header
        assert header is not None
        names, units = header.names, header.units
        if self._beside is not None and self._beside.header is not None:
            beside, kept = self._beside.header, self._kept()
            names += tuple(beside.names[k] for k in kept)
            units += tuple(beside.units[k] for k in kept)
        return names, units

    def _wanted(self, time: float) -> float:
        """When a row is due, by the clock of this machine."""
        if not self.paced or self.speed == 0.0:
            return 0.0
        if self._begun is None:
            self._begun = (time, clock.monotonic())
        return self._begun[1] + (time - self._begun[0]) / self.speed

    def _pause(self) -> float:
        return self._wanted(self._ahead[0][1]) - clock.monotonic() if self._ahead and self._interval else LOOK

    def _due(self) -> list[Block]:
        if not self._interval:
            return []
        now = clock.monotonic()
        n = 0
        while n < min(len(self._ahead), MOST) and self._wanted(self._ahead[n][1]) <= now:
            n += 1
        rows, self._ahead = self._ahead[:n], self._ahead[n:]
        found = []
        while rows:
            block, taken = self._grouped(rows)
            found.append(block)
            rows = rows[taken:]
        return found

    def _grouped(self, rows: list[tuple[int, float, list[float]]]) -> tuple[Block, int]:
        number, begin, _ = rows[0]
        n = 1
        if len(rows) > 1:
            interval = rows[1][1] - begin
            if interval > 0.0 and _exact(begin) and _exact(interval):
                while n < len(rows) and begin + n * interval == rows[n][1] and rows[n][0] == number + n:
                    n += 1
        apart = rows[1][1] - begin if n > 1 else self._interval
        values = array("d", [v for row in rows[:n] for v in row[2]])
        names, units = self._names()
        return Block(self._stream, rows[n - 1][0], begin, apart, names, units, values), n


def _exact(time: float) -> bool:
    return (1024.0 * time).is_integer()


def replay_of(run: Path, speed: float) -> CsvSource:
    """The loads of a run folder, and its temperatures where it has them, at a multiple of their speed; 0: at once."""
    side = run / "temperatures.csv"
    return CsvSource(run / "loads.csv", side if side.is_file() else None, speed, paced=True)
