"""Rows of a CSV log as they are appended: a header `name [unit]`, a first column of times, numbers.

Made for a file that grows: nothing but whole lines is read, and lines one by one. `twin.logs.csv_table` reads a whole
file, and says better what is wrong in one.
"""

from __future__ import annotations

import math
from datetime import datetime
from pathlib import Path

from twin.errors import LogError
from twin.units import Unit, parse_unit

_ISO = ("iso", "iso8601", "utc")


class Header:
    """Columns of a file, read from its first line."""

    def __init__(self, line: str, path: Path):
        """Raises LogError for headers that are none."""
        self.path = path
        self.delimiter = ";" if ";" in line else "\t" if "\t" in line else ","
        cells = [c.strip().strip('"').strip() for c in line.strip().split(self.delimiter)]
        self.clock = self._unit(cells[0], True)
        self.names = tuple(c.partition("[")[0].strip() for c in cells[1:])
        self.factors = [self._unit(c, False) or parse_unit("1") for c in cells[1:]]
        self.units = tuple(u.si for u in self.factors)
        if not self.names or len(set(self.names)) != len(self.names):
            raise LogError("no columns, or two of one name", str(path), "headers are 'time [s],x_speed [m/min]'")

    def _unit(self, cell: str, time: bool) -> Unit | None:
        text = cell.partition("[")[2].partition("]")[0].strip()
        if time and text.lower() in ("", *_ISO):
            return None
        try:
            unit = parse_unit(text or "1")
        except ValueError as e:
            raise LogError(str(e), f"{self.path} (header)", "headers are 'name [unit]', such as 'duty [1]'") from e
        if time and unit.si != "s":
            raise LogError("the first column is no time", f"{self.path} (header)", "begin with 'time [s]'")
        return unit

    def row(self, line: str) -> tuple[float, list[float]] | None:
        """Time [s] and values [SI] of a line; empty cells are NaN; None for a line that is no row."""
        cells = line.strip().split(self.delimiter)
        if len(cells) != len(self.names) + 1:
            return None
        if self.delimiter != ",":
            cells = [c.replace(",", ".") for c in cells]
        try:
            time = self._time(cells[0])
            values = [float(c) * u.factor + u.offset if c.strip() else math.nan
                      for c, u in zip(cells[1:], self.factors, strict=True)]  # fmt: skip
        except ValueError:
            return None
        return (time, values) if math.isfinite(time) else None

    def _time(self, cell: str) -> float:
        if self.clock is not None:
            return float(cell) * self.clock.factor
        moment = datetime.fromisoformat(cell.strip().strip('"'))
        if moment.tzinfo is None:
            raise LogError("a time without a zone", str(self.path), "write 2026-03-01T08:00:00+01:00, or time [s]")
        return moment.timestamp()


class GrowingFile:
    """Whole lines of a file that is appended to, from any line on; a file that is replaced begins anew."""

    def __init__(self, path: Path):
        self.path = path
        self.header: Header | None = None
        self.line = 0  # of rows, number of the next
        self._at = 0  # bytes
        self._inode = -1
        self._rest = b""

    def lines(self, most: int) -> list[str]:
        """Up to so many further lines, the header not among them. Raises LogError for a bad header."""
        try:
            with self.path.open("rb") as f:
                stat = self.path.stat()
                if stat.st_ino != self._inode or stat.st_size < self._at:
                    self._inode, self._at, self._rest, self.line, self.header = stat.st_ino, 0, b"", 0, None
                f.seek(self._at)
                data = f.read(200 * most + 4096)
        except FileNotFoundError:
            return []
        except OSError as e:
            raise LogError(f"cannot read: {e.strerror or e}", str(self.path), "check its permissions") from e
        whole, mark, _ = data.rpartition(b"\n")
        if not mark:
            return []
        found = whole.split(b"\n")
        if self.header is None:
            first = found.pop(0)
            self.header = Header(first.decode("utf-8-sig", "replace"), self.path)
            self._at += len(first) + 1
        taken = found[:most]
        self._at += sum(len(line) + 1 for line in taken)
        self.line += len(taken)
        return [line.decode("utf-8", "replace") for line in taken]
