"""One CSV file of a log: headers `name [unit]`, `,` or `;` or tabs between cells, decimal points or commas.

The body goes through numpy's C reader; only a file that it refuses is read cell by cell, to name what is wrong.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import tzinfo
from pathlib import Path

import numpy as np

from twin.errors import LogError, Problem
from twin.logs.decimal_marks import mark_problems
from twin.logs.times import parse_iso
from twin.ordinary import ordinary
from twin.units import Unit, parse_unit

_HEADER = re.compile(r"(?P<name>[^\[\]]+?)\s*(?:\[(?P<unit>[^\[\]]*)\])?")
_ISO_UNITS = {"iso", "iso8601", "iso 8601", "iso-8601", "utc"}
_SHOWN = 10  # problems of one file shown at once


@dataclass(frozen=True)
class CsvTable:
    """A file as read: values in SI, times in seconds (POSIX where `absolute`, else as counted by the log)."""

    time: np.ndarray  # (n,)
    absolute: bool  # ISO times
    naive: bool  # ISO times without a zone
    columns: dict[str, np.ndarray]  # (n,) each
    units: dict[str, str]  # SI


def read_csv(path: Path, zone: tzinfo | None = None) -> CsvTable:
    """Read one table. Empty cells become NaN.

    Raises LogError: unreadable file, nul bytes, headers without or with unknown units, columns named twice, no time
    column, rows of the wrong length, cells that are no numbers, decimal points among decimal commas, times without a
    zone where `zone` is None, or that its clock shows twice or never.
    """
    lines = _lines(path)
    delimiter = ";" if ";" in lines[0] else "\t" if "\t" in lines[0] else ","
    names, clock, units = _header(lines[0], delimiter, path)
    body = lines[1:]
    if not body:
        raise LogError("no rows under the header", str(path), "log at least one row, or remove the file")
    if delimiter != "," and (mixed := mark_problems(body, delimiter, 1 if clock is None else 0, names, str(path))):
        raise LogError.collect(mixed)
    naive = False
    if clock is None:
        cells = [line.partition(delimiter) for line in body]
        time, naive = parse_iso([c[0] for c in cells], zone, str(path))
        values = _values([c[2] for c in cells], delimiter, names[1:], path)
    else:
        table = _values(body, delimiter, names, path)
        time, values = table[:, 0] * clock.factor, table[:, 1:]
        if not np.isfinite(time).all():
            line = int(np.argmin(np.isfinite(time))) + 2
            raise LogError("a time is missing", f"{path} (line {line})", "fix the row")
    columns = {
        name: values[:, k] * u.factor + u.offset for k, (name, u) in enumerate(zip(names[1:], units, strict=True))
    }
    si = {name: unit.si for name, unit in zip(names[1:], units, strict=True)}
    return CsvTable(time, clock is None, naive, columns, si)


def _lines(path: Path) -> list[str]:
    """Lines of the file, the header first, without blank lines at the end."""
    try:
        raw = ordinary(path).read_bytes()
    except OSError as e:
        raise LogError(f"cannot read: {e.strerror or e}", str(path), "check the path and its permissions") from e
    try:
        text = raw.decode("utf-16" if raw[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeError:
        text = raw.decode("latin-1")  # what German controls write; every byte is a character there
    if "\0" in text:
        line = re.split("\r\n|\r|\n", text[: text.index("\0")])
        remedy = "the logger stopped while writing, or the file is UTF-16 without its mark: fix or convert it"
        raise LogError("nul bytes", f"{path} (line {len(line)})", remedy)
    # Line numbers in messages must be the file's own, so blank lines are cut at the end only.
    lines = text.replace("\r\n", "\n").replace("\r", "\n").rstrip("\n ").split("\n")
    if not lines[0].strip():
        raise LogError("no headers", str(path), "the first line holds headers such as 'time [s],x_speed [m/min]'")
    return lines


def _header(line: str, delimiter: str, path: Path) -> tuple[list[str], Unit | None, list[Unit]]:
    """Names of the columns, the unit of the time (None for ISO 8601) and those of the other columns."""
    cells = [c.strip().strip('"').strip() for c in line.split(delimiter)]
    while len(cells) > 1 and not cells[-1]:
        cells.pop()  # a delimiter at the end of the line
    problems: list[Problem] = []
    names: list[str] = []
    clock: Unit | None = None
    units: list[Unit] = []
    for k, cell in enumerate(cells):
        where = f"{path} (header, column {k + 1})"
        match = _HEADER.fullmatch(cell)
        name, unit = (match["name"].strip(), match["unit"]) if match else (cell, None)
        try:
            if k == 0:
                clock = _time_unit(name, unit)
            else:
                units.append(_column_unit(name, unit, bool(match)))
        except ValueError as e:
            remedy = "headers are 'name [unit]', for example 'x_speed [m/min]' or 'duty [1]'"
            problems.append(Problem(str(e), where, remedy))
        if name in names:
            problems.append(Problem(f"column '{name}' appears twice", where, "rename or remove one of them"))
        names.append(name)
    if problems:
        raise LogError.collect(problems[:_SHOWN])
    return names, clock, units


def _time_unit(name: str, unit: str | None) -> Unit | None:
    if name.casefold() not in ("time", "zeit", "t", "timestamp"):
        raise ValueError(f"the first column is '{name[:40]}', not the time")
    if unit is None or unit.strip().casefold() in _ISO_UNITS:
        return None
    parsed = parse_unit(unit)
    if parsed.si != "s":
        raise ValueError(f"the time is in '{unit}', which is not a time")
    return parsed


def _column_unit(name: str, unit: str | None, well_formed: bool) -> Unit:
    if not well_formed:
        raise ValueError(f"cannot read the header '{name[:40]}'")
    if unit is None:
        raise ValueError(f"column '{name[:40]}' has no unit")
    try:
        return parse_unit(unit)
    except ValueError as e:
        raise ValueError(f"column '{name[:40]}': {e}") from e


def _values(body: list[str], delimiter: str, names: list[str], path: Path) -> np.ndarray:
    """Numbers (n_rows, n_columns)."""
    if not names:
        return np.empty((len(body), 0))
    if delimiter != ",":
        body = "\n".join(body).replace(",", ".").split("\n")
    if all(line.endswith(delimiter) for line in body) and body[0].count(delimiter) == len(names):
        body = [line[:-1] for line in body]
    try:
        table = np.loadtxt(body, delimiter=delimiter, comments=None, ndmin=2)
        if table.shape == (len(body), len(names)):  # numpy skips blank lines
            return table
    except (ValueError, OverflowError):
        pass
    return _cell_by_cell(body, delimiter, names, path)


def _cell_by_cell(body: list[str], delimiter: str, names: list[str], path: Path) -> np.ndarray:
    """The same for files that numpy refuses: empty cells, quotes, and mistakes, all of which are reported."""
    table = np.full((len(body), len(names)), np.nan)
    problems: list[Problem] = []
    for i, line in enumerate(body):
        cells = line.split(delimiter)
        if len(cells) > len(names) and not any(c.strip() for c in cells[len(names) :]):
            cells = cells[: len(names)]
        if len(cells) != len(names):
            problems.append(_ragged(len(cells), len(names), delimiter, f"{path} (line {i + 2})"))
        else:
            for k, cell in enumerate(cells):
                cell = cell.strip().strip('"')
                if not cell:
                    continue
                try:
                    table[i, k] = float(cell.replace("_", "no digit"))  # Python reads 1_000 as a number
                except ValueError:
                    problems.append(_no_number(cell, names[k], k == 0, f"{path} (line {i + 2})"))
        if len(problems) >= _SHOWN:
            break
    if problems:
        raise LogError.collect(problems)
    return table


def _no_number(cell: str, column: str, first: bool, where: str) -> Problem:
    remedy = "leave a missing value empty; write no thousands separators"
    if first and ":" in cell:
        remedy = "ISO times stand under 'time', without a unit"
    return Problem(f"'{cell[:40]}' in column '{column}' is not a number", where, remedy)


def _ragged(found: int, expected: int, delimiter: str, where: str) -> Problem:
    remedy = "every row needs a cell for each header"
    if delimiter == ",":
        remedy += "; with decimal commas separate the cells by ';'"
    return Problem(f"{found} cells under {expected} headers", where, remedy)
