"""What the columns of a log of unknown origin are: told, written in the header, or guessed by name and values.

Guesses are shown, never silent: a column that is nothing is left out and listed with the reason.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twin.errors import LogError
from twin.logs.csv_table import CsvTable, read_csv
from twin.logs.run import Run, Table, Tcp
from twin.nearest import did_you_mean
from twin.ordinary import ordinary
from twin.units import parse_unit

AXES = ("dx", "dy", "dz")
# A header as loggers write it: "PT01", "Disp. X [um]", "spindle speed (1/min)"
_HEADER = re.compile(r"\s*(?P<name>[^\[\](]*?)\s*(?:[\[(](?P<unit>[^\])]*)[\])])?\s*")
_DISPLACEMENT = re.compile(r"disp|deviation|drift|probe|error|\bd[xyz]\b", re.IGNORECASE)
_SPEED = re.compile(r"speed|rpm|drehzahl|\bn\b", re.IGNORECASE)
_POWER = re.compile(r"power|leistung", re.IGNORECASE)
_TEMPERATURE = re.compile(r"temp|^t\d+$|^[pt][tc]\d+$|air|ambient|coolant|oil|room", re.IGNORECASE)
PLAUSIBLE = (-30.0, 150.0)  # degC, of a sensor on a machine tool
LENGTH = (3600.0, 2.0e6)  # s, of a log that shows heat: one hour to three weeks
STEP = (0.1, 900.0)  # s between rows


@dataclass(frozen=True)
class Column:
    """A column, and what it is taken for."""

    name: str  # as in the file
    unit: str  # as told, written or guessed; "" where it is left out
    role: str  # "time", "temperature", "load", "dx", "dy", "dz", "left out"
    how: str  # "told", "written", or why it was guessed


def read_log(path: Path, told: Mapping[str, str] = {}, axes: Mapping[str, str] = {}) -> tuple[Run, tuple[Column, ...]]:
    """A CSV file (or XLSX, with openpyxl installed) as a run that starts in its steady state, and what its columns are.

    told: units by column, "" to leave one out. axes: "dx", "dy" or "dz" -> the column that measures it.
    Raises LogError for files that are no table, columns that are not there, and a log without temperatures.
    """
    lines, delimiter = _lines(path)
    names, written = _names(lines[0], delimiter, path)
    for name in (*told, *axes.values()):
        if name not in names:
            raise LogError(f"no column '{name}'", str(path), did_you_mean(name, names, "columns"))
    bare = delimiter.join(["time [s]", *(f"c{k} [1]" for k in range(1, len(names)))])
    absolute = _is_iso(lines, delimiter)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "log.csv"
        file.write_text(
            "\n".join([bare.replace("time [s]", "time") if absolute else bare, *lines[1:]]), encoding="utf-8"
        )
        table = _read(file, path)
    columns = [_time(names[0], written[0], told, table, path)]
    values = {name: table.columns[f"c{k}"] for k, name in enumerate(names) if k}
    columns += [
        _column(name, unit, told, axes, values[name]) for name, unit in zip(names[1:], written[1:], strict=True)
    ]
    columns = _spread(columns, axes)
    return _run(path, columns, table, values), tuple(columns)


def _read(file: Path, path: Path) -> CsvTable:
    from datetime import UTC

    try:
        return read_csv(file, UTC)
    except LogError as e:
        raise LogError.collect(
            [type(p)(p.what, p.where.replace(str(file), str(path)), p.remedy) for p in e.problems]
        ) from e


def _lines(path: Path) -> tuple[list[str], str]:
    if path.suffix.casefold() in (".xlsx", ".xlsm"):
        return _sheet(path), ","
    try:
        text = ordinary(path).read_bytes().decode("utf-8-sig", errors="replace")
    except OSError as e:
        raise LogError(f"cannot read: {e.strerror or e}", str(path), "check the path and its permissions") from e
    lines = [line for line in text.replace("\r\n", "\n").replace("\r", "\n").split("\n") if line.strip()]
    if len(lines) < 3:
        raise LogError("no table", str(path), "give a CSV file: headers in the first line, a row per sample below")
    return lines, ";" if ";" in lines[0] else "\t" if "\t" in lines[0] else ","


def _sheet(path: Path) -> list[str]:
    """The first sheet of a workbook as lines of a CSV file."""
    try:
        from openpyxl import load_workbook
    except ModuleNotFoundError as e:
        remedy = "pip install 'twin[xlsx]', or save the sheet as CSV"
        raise LogError("XLSX files need openpyxl", str(path), remedy) from e
    try:
        sheet = load_workbook(path, read_only=True, data_only=True).worksheets[0]
        rows = [["" if cell is None else str(cell) for cell in row] for row in sheet.iter_rows(values_only=True)]
    except Exception as e:
        raise LogError(f"no workbook: {e}", str(path), "save the sheet as CSV") from e
    return [",".join(cell.replace(",", ".") for cell in row) for row in rows if any(row)]


def _names(header: str, delimiter: str, path: Path) -> tuple[list[str], list[str]]:
    names, units = [], []
    for k, cell in enumerate(header.split(delimiter)):
        match = _HEADER.fullmatch(cell.strip().strip('"'))
        name = match["name"] if match and match["name"] else cell.strip() or f"column {k + 1}"
        names.append(name)
        units.append((match["unit"] or "").strip() if match else "")
    if len(set(names)) < len(names):
        twice = next(n for n in names if names.count(n) > 1)
        raise LogError(f"column '{twice}' appears twice", f"{path} (line 1)", "rename or remove one of them")
    return names, units


def _is_iso(lines: Sequence[str], delimiter: str) -> bool:
    first = lines[1].split(delimiter)[0].strip().strip('"')
    return bool(re.match(r"\d{4}-\d\d-\d\d", first))


def _time(name: str, written: str, told: Mapping[str, str], table: CsvTable, path: Path) -> Column:
    if table.absolute:
        return Column(name, "s", "time", "dates and times")
    if unit := told.get(name, written):
        if parse_unit(unit).si != "s":
            raise LogError(f"the time is in '{unit}', which is not a time", str(path), f"give --unit '{name}=min'")
        return Column(name, unit, "time", "told" if name in told else "written")
    span, step = float(np.ptp(table.time)), float(np.median(np.diff(table.time)))
    for unit in ("s", "min", "h", "ms", "d"):
        factor = parse_unit(unit).factor
        if LENGTH[0] <= span * factor <= LENGTH[1] and STEP[0] <= step * factor <= STEP[1]:
            return Column(
                name, unit, "time", f"guessed: {span * factor / 3600.0:.3g} h, a row every {step * factor:.3g} s"
            )
    raise LogError(f"the unit of '{name}' is not told", str(path), f"give --unit '{name}=s', for example")


def _column(name: str, written: str, told: Mapping[str, str], axes: Mapping[str, str], values: np.ndarray) -> Column:
    axis = next((a for a, column in axes.items() if column == name), None)
    if name in told and not told[name]:
        return Column(name, "", "left out", "told")
    if not np.isfinite(values).any() or np.nanmax(values) == np.nanmin(values):
        return Column(name, "", "left out", "never changes")
    unit, how = (told[name], "told") if name in told else (written, "written")
    if not unit:
        unit, how = _guessed(name, values, axis)
    if not unit:
        return Column(name, "", "left out", how)
    try:
        si = parse_unit(unit).si
    except ValueError as e:
        raise LogError(str(e), name, f"give --unit '{name}=degC', for example") from e
    if si == "degC":
        return Column(name, unit, "temperature", how)
    if si == "m":
        return Column(name, unit, axis or "displacement", how)
    if si in ("1/s", "m/s", "W"):
        return Column(name, unit, "load", how)
    return Column(name, unit, "left out", f"a {unit} drives nothing here")


def _guessed(name: str, values: np.ndarray, axis: str | None) -> tuple[str, str]:
    if axis or _DISPLACEMENT.search(name):
        return "um", "guessed by its name"
    if _SPEED.search(name):
        return "1/min", "guessed by its name"
    if _POWER.search(name):
        return "W", "guessed by its name"
    low, high = float(np.nanquantile(values, 0.02)), float(np.nanquantile(values, 0.98))
    if PLAUSIBLE[0] <= low and high <= PLAUSIBLE[1]:
        named = _TEMPERATURE.search(name)
        if named or (high - low < 60.0 and low > 5.0):
            return (
                "degC",
                "guessed by its name" if named else f"guessed: {low:.4g} .. {high:.4g} looks like a temperature",
            )
    return "", f"nothing known: {low:.4g} .. {high:.4g}"


def _spread(columns: Sequence[Column], axes: Mapping[str, str]) -> list[Column]:
    """Displacements without an axis: by a letter x, y or z in the name, else in the order of columns."""
    result = list(columns)
    free = [a for a in AXES if a not in axes]
    waiting = [k for k, c in enumerate(result) if c.role == "displacement"]
    lettered: dict[int, str] = {}
    for k in waiting:
        match = re.search(r"(?<![a-z])d?([xyz])(?![a-z])", result[k].name, re.IGNORECASE)
        axis = f"d{match[1].lower()}" if match else ""
        if axis in free and axis not in lettered.values():
            lettered[k] = axis
    for k in waiting:
        left = [a for a in free if a not in lettered.values()]
        axis = lettered.get(k) or (left[0] if left else "")
        lettered[k] = axis
        c = result[k]
        result[k] = Column(
            c.name, c.unit, axis or "left out", c.how if axis else "a fourth displacement: choose by --axis"
        )
    return result


def as_name(column: str) -> str:
    """A column as a name that a description allows: "Spindle Motor" is "Spindle_Motor"."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", column).strip("_") or "column"


def _run(path: Path, columns: Sequence[Column], table: CsvTable, values: Mapping[str, np.ndarray]) -> Run:
    def si(c: Column) -> np.ndarray:
        unit = parse_unit(c.unit)
        return values[c.name] * unit.factor + unit.offset

    time = table.time * parse_unit(columns[0].unit).factor
    time = time - time[0]
    if not np.all(np.diff(time) > 0.0):
        keep = np.concatenate([[True], np.diff(np.maximum.accumulate(time)) > 0.0])
        line = int(np.argmin(keep)) + 2
        raise LogError("times do not increase", f"{path} (line {line})", "sort the rows, or cut the log in two")
    heat = {as_name(c.name): si(c) for c in columns if c.role == "temperature"}
    loads = {as_name(c.name): si(c) for c in columns if c.role == "load"}
    if not heat:
        raise LogError("no temperatures", str(path), "tell them: --unit 'COLUMN=degC'")
    units = {as_name(c.name): parse_unit(c.unit).si for c in columns if c.role in ("temperature", "load")}
    driven = loads or dict(list(heat.items())[:1])  # loads.csv needs a column: the first temperature does
    displacement = np.full((len(time), 3), np.nan)
    for c in columns:
        if c.role in AXES:
            displacement[:, AXES.index(c.role)] = si(c)
    tcp = Tcp(time, (), np.zeros((len(time), 0)), displacement) if np.isfinite(displacement).any() else None
    return Run(
        loads=Table(time, driven, {k: units[k] for k in driven}),
        temperatures=Table(time, heat, {k: units[k] for k in heat}),
        tcp=tcp,
        provenance=f"{path.name}, read by twin new",
        steady_start=True,
        folder=path.with_suffix(""),
        tcp_reference="first",
    )
