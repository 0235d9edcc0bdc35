"""Measured TCP errors as events: rows of files that grow or appear, and the store of those that were used.

A row is one of tcp.csv: time, the positions of the axes, dx, dy, dz (any of them empty), optionally `sigma`, and
`corrected [1]`: 1 where the offsets of this process were active while it was measured. What was used is stored with the
number of the step after which it was, so that a process that was killed comes to the same numbers.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from twin.atomic import atomic_path, telling
from twin.errors import LogError, TwinError
from twin.live.csv_rows import GrowingFile, Header
from twin.live.facts import Facts

MOST = 1000  # rows taken at once
KEPT = 1000  # used ones that stay in the store when it is shortened
_MOVED = ("dx", "dy", "dz")


@dataclass(frozen=True)
class Measured:
    """A row."""

    time: float  # s, by the clock of the log
    position: tuple[float, ...]  # m, in the order of the axes
    displacement: tuple[float, float, float]  # m, tool minus work side; NaN: not measured
    sigma: float  # m; NaN: not known
    corrected: bool  # with the offsets active


@dataclass(frozen=True)
class Used:
    """A row as the model learnt it: without offsets, in the model's time."""

    number: int  # from zero on
    steps: int  # of the machine that were complete when it was learnt
    time: float  # s since the machine was started
    position: tuple[float, ...]
    displacement: tuple[float, ...]  # m
    sigma: float  # m
    stamp: float  # s, by the clock of the log


class Events:
    """New rows of a file, or of all files *.csv of a folder."""

    def __init__(self, path: Path, facts: Facts):
        """Raises TwinError where there is neither a file nor a folder."""
        if not path.exists():
            remedy = "name a tcp.csv that grows, or a folder in which such files appear"
            raise TwinError("no file and no folder", str(path), remedy)
        self.path, self._axes = path, tuple(a.name for a in facts.axes)
        self._files: dict[Path, GrowingFile] = {}
        self.wrong = 0  # rows that are none
        self.error = ""  # of a file that is none

    def poll(self) -> list[Measured]:
        """What has come since. A file that cannot be read is told in `error`, and looked at again."""
        found: list[Measured] = []
        self.error = ""
        for path in sorted(self.path.glob("*.csv")) if self.path.is_dir() else [self.path]:
            file = self._files.setdefault(path, GrowingFile(path))
            try:
                lines = file.lines(MOST)
                if file.header is not None:
                    self._refuse(file.header)
            except LogError as e:
                self.error = str(e.problems[0])
                continue
            rows = [self._row(file.header, line) for line in lines if line.strip() and file.header is not None]
            self.wrong += rows.count(None)
            found += [row for row in rows if row is not None]
        return sorted(found, key=lambda row: row.time)

    def _refuse(self, header: Header) -> None:
        """Raises LogError for columns that are no measurement."""
        units = dict(zip(header.names, header.units, strict=True))
        wanted = dict.fromkeys((*self._axes, *(m for m in _MOVED if m in units)), "m")
        lacking = [name for name, unit in wanted.items() if units.get(name) != unit]
        if lacking or not any(m in units for m in _MOVED):
            columns = ", ".join((*self._axes, "dx, dy or dz"))
            raise LogError(f"no columns {columns} in a length", str(header.path), "see docs/live.md, 'Measured errors'")

    def _row(self, header: Header, line: str) -> Measured | None:
        try:
            read = header.row(line)
        except LogError:
            read = None
        if read is None:
            return None
        time, values = read
        of = dict(zip(header.names, values, strict=True))
        position = tuple(of[a] for a in self._axes)
        dx, dy, dz = (of.get(m, math.nan) for m in _MOVED)
        known = [v for v in (dx, dy, dz) if math.isfinite(v)]
        sound = all(map(math.isfinite, position)) and known and max(map(abs, known)) < 1e-3
        sigma = of.get("sigma", math.nan)
        sigma = sigma if sigma > 0.0 else math.nan
        return Measured(time, position, (dx, dy, dz), sigma, of.get("corrected", 0.0) > 0.5) if sound else None


class Store:
    """measured.jsonl: a line per row that was used, synchronised before the model learns it."""

    def __init__(self, path: Path):
        self.path = path
        self.used: list[Used] = list(self._read())

    def append(self, used: Used) -> None:
        """Raises TwinError where the disk is full."""
        with telling(self.path), self.path.open("a", encoding="utf-8") as f:
            f.write(json.dumps(asdict(used)) + "\n")
            f.flush()
            os.fsync(f.fileno())
        self.used.append(used)

    def has(self, row: Measured) -> bool:
        """Whether it was used before: files are read from the beginning after a restart."""
        return any(u.stamp == row.time and u.position == row.position for u in self.used)

    def keep(self, used: list[Used]) -> None:
        """These alone. Raises TwinError as `append`."""
        if len(used) < len(self.used):
            self.used = used
            with atomic_path(self.path) as part:
                part.write_text("".join(json.dumps(asdict(u)) + "\n" for u in used), encoding="utf-8")

    def clear(self) -> None:
        self.path.unlink(missing_ok=True)
        self.used = []

    def _read(self) -> Iterator[Used]:
        try:
            text = self.path.read_text(encoding="utf-8")
        except FileNotFoundError:
            return
        for line in text.splitlines():
            try:
                told: dict[str, Any] = json.loads(line)
                yield Used(**told | {k: tuple(told[k]) for k in ("position", "displacement")})
            except (ValueError, TypeError, KeyError):
                return  # cut off while it was written: it was not learnt either
