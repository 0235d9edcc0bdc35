"""Reading a run folder: run.toml, loads.csv, temperatures.csv, tcp.csv."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from contextlib import suppress
from datetime import UTC, datetime, tzinfo
from pathlib import Path
from typing import Any, Literal

import numpy as np

from twin.errors import LogError
from twin.logs.csv_table import CsvTable, read_csv
from twin.logs.refuse import refusals
from twin.logs.run import Run, Table, Tcp
from twin.logs.segments import read_segments
from twin.logs.times import in_zone, zone_of
from twin.nearest import did_you_mean
from twin.ordinary import ordinary
from twin.units import machine_temperature, to_si

TABLES = ("loads", "temperatures", "tcp")
_KEYS = (
    "start", "zone", "sampling", "sampling_s", "provenance", "source", "synthetic", "initial_temperature", "machine",
    "description", "segments", "tcp_reference",
)  # fmt: skip
_DISPLACEMENT = ("dx", "dy", "dz")


def read_run(folder: Path) -> Run:
    """The run in `folder`, in SI: `parse_run`, and refused where results from it would be wrong in silence.

    Every verb reads runs with this. Nothing is repaired: `check_run` tells what else is odd.

    Raises LogError: all of `parse_run`, and all that `refusals` finds.
    """
    run = parse_run(folder)
    problems = refusals(run)
    if problems:
        raise LogError.collect(problems)
    return run


def parse_run(folder: Path) -> Run:
    """The run in `folder` as it stands, in SI, for those who list what is wrong with it; others use `read_run`.

    run.toml: start (TOML date-time with offset, or "unknown"), zone, sampling ("5 s"), provenance, synthetic (true,
    false, or the names of computed tables), initial_temperature, machine (path of its description), segments
    (tables of name, start, end), tcp_reference ("absolute" or "first"). Files for other purposes may lie beside it.

    Raises LogError: run.toml or loads.csv missing, malformed files, times without a zone, units of the wrong dimension.
    """
    folder = Path(folder)
    facts = _facts(folder)
    where = folder / "run.toml"
    zone = facts.get("zone")
    if zone is not None and not isinstance(zone, str):
        raise LogError("zone is not a string", str(where), 'write an IANA name: zone = "Europe/Berlin"')
    tz = zone_of(zone, str(where)) if zone else None
    start = _start(facts.get("start"), tz, where)
    loads = _read(folder, "loads", tz)
    if loads is None:
        raise LogError("no loads.csv", str(folder), "a run folder needs run.toml and loads.csv")
    tables = {"temperatures": _read(folder, "temperatures", tz), "tcp": _read(folder, "tcp", tz)}
    if start is None and loads.absolute:
        start = _first_time(loads, tz or UTC, folder / "loads.csv")
    zero = start.timestamp() if start else None
    temperatures = tables["temperatures"]
    tcp = tables["tcp"]
    loads_table = _table(loads, zero, folder / "loads.csv")
    return Run(
        loads=loads_table,
        temperatures=_table(temperatures, zero, folder / "temperatures.csv", "degC") if temperatures else None,
        tcp=_tcp(tcp, zero, folder / "tcp.csv") if tcp else None,
        start=start,
        zone=zone,
        sampling=_sampling(facts, where),
        provenance=str(facts.get("provenance", facts.get("source", ""))),
        synthetic=_synthetic(facts.get("synthetic", False), where),
        initial_temperature=None if _steady(facts) else _initial(facts, where),
        steady_start=_steady(facts),
        machine=_text(facts, "machine", where),
        folder=folder,
        segments=read_segments(facts.get("segments", []), str(where), loads_table.time.min(), loads_table.time.max()),
        tcp_reference=_tcp_reference(facts.get("tcp_reference", "absolute"), where),
    )


def _tcp_reference(value: Any, where: Path) -> Literal["absolute", "first"]:
    if value == "absolute":
        return "absolute"
    if value == "first":
        return "first"
    raise LogError(
        f"tcp_reference = {value!r}"[:80],
        str(where),
        'write "absolute", or "first" where the deviations in tcp.csv count from its first row',
    )


def _facts(folder: Path) -> dict[str, Any]:
    path = folder / "run.toml"
    try:
        facts = tomllib.loads(ordinary(path).read_bytes().decode("utf-8-sig"))
    except (FileNotFoundError, NotADirectoryError) as e:
        raise LogError(
            "no run.toml",
            str(folder),
            'make one with: start = 2026-03-01T08:00:00+01:00, sampling = "5 s", synthetic = false',
        ) from e
    except OSError as e:
        raise LogError(f"cannot read: {e.strerror or e}", str(path), "check the path and its permissions") from e
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError, ValueError) as e:
        raise LogError(f"not valid TOML: {e}", str(path), 'strings need quotes: zone = "Europe/Berlin"') from e
    unknown = [key for key in facts if key not in _KEYS]
    if unknown:
        raise LogError(
            f"unknown keys: {', '.join(unknown)}",
            str(path),
            " ".join(did_you_mean(key, _KEYS, "keys") for key in unknown),
        )
    return facts


def _start(value: Any, zone: tzinfo | None, where: Path) -> datetime | None:
    if value is None or value == "unknown":
        return None
    if isinstance(value, str):
        with suppress(ValueError):
            value = datetime.fromisoformat(value)
    if not isinstance(value, datetime):
        raise LogError(f"start '{value}' is not a date and time", str(where), "write start = 2026-03-01T08:00:00+01:00")
    if value.tzinfo is None:
        if zone is None:
            raise LogError("start has no zone", str(where), "write start = 2026-03-01T08:00:00+01:00, or add a zone")
        try:
            value = in_zone(value, zone)
        except (ValueError, OverflowError) as e:
            raise LogError(f"start: {e}", str(where), "write its offset: start = 2026-03-01T08:00:00+01:00") from e
    try:
        value.timestamp()
    except (OverflowError, ValueError, OSError) as e:
        raise LogError(f"start '{value}' is out of range", str(where), "write start = 2026-03-01T08:00:00+01:00") from e
    return value


def _first_time(loads: CsvTable, zone: tzinfo, where: Path) -> datetime:
    try:
        return datetime.fromtimestamp(float(loads.time[0]), zone)
    except (OverflowError, ValueError, OSError) as e:
        raise LogError("the first time is out of range", str(where), "check the year") from e


def _quantity(facts: Mapping[str, Any], key: str, unit: str, where: Path, also: str = "") -> float | None:
    value = facts.get(key, facts.get(also))
    if value is None:
        return None
    try:
        return to_si(value, unit)
    except ValueError as e:
        raise LogError(f"{key}: {e}", str(where), f"give a number in {unit} or a string with a unit") from e


def _sampling(facts: Mapping[str, Any], where: Path) -> float | None:
    value = _quantity(facts, "sampling", "s", where, also="sampling_s")
    if value is not None and value <= 0.0:
        raise LogError(f"sampling is {value:g} s", str(where), 'give the time between rows: sampling = "5 s"')
    return value


def _steady(facts: Mapping[str, Any]) -> bool:
    return facts.get("initial_temperature") == "steady"


def _initial(facts: Mapping[str, Any], where: Path) -> float | None:
    value = _quantity(facts, "initial_temperature", "degC", where)
    try:
        return None if value is None else machine_temperature(value)
    except ValueError as e:
        raise LogError(f"initial_temperature: {e}", str(where), 'write initial_temperature = "20 degC"') from e


def _text(facts: Mapping[str, Any], key: str, where: Path) -> str | None:
    value = facts.get(key)
    if value is not None and not isinstance(value, str):
        raise LogError(f"{key} is not a string", str(where), f'write {key} = "..."')
    return value


def _synthetic(value: Any, where: Path) -> tuple[str, ...]:
    if isinstance(value, bool):
        return TABLES if value else ()
    if isinstance(value, list) and all(isinstance(v, str) and v in TABLES for v in value):
        return tuple(value)
    raise LogError(
        f"synthetic = {value!r}"[:80], str(where), 'write true, false, or the computed tables: ["loads", "tcp"]'
    )


def _read(folder: Path, name: str, zone: tzinfo | None) -> CsvTable | None:
    path = folder / f"{name}.csv"
    return read_csv(path, zone) if path.exists() else None


def _relative(table: CsvTable, zero: float | None, path: Path) -> np.ndarray:
    """Time since the start of the run (n,) s."""
    if not table.absolute:
        return table.time
    if zero is None:
        raise LogError(
            "ISO times, but the start of the run is unknown",
            str(path),
            "give start in run.toml, or ISO times in loads.csv too",
        )
    return table.time - zero


def _table(table: CsvTable, zero: float | None, path: Path, unit: str | None = None) -> Table:
    wrong = [f"{name} [{si}]" for name, si in table.units.items() if unit and si != unit]
    if wrong:
        raise LogError(f"columns that are not in {unit}: {', '.join(wrong)}", str(path), f"headers are 'name [{unit}]'")
    return Table(_relative(table, zero, path), table.columns, table.units, table.naive)


def _tcp(table: CsvTable, zero: float | None, path: Path) -> Tcp:
    if not any(name in table.columns for name in _DISPLACEMENT):
        raise LogError(
            "no column of dx, dy, dz",
            str(path),
            "columns are: time, the axis positions, those of dx, dy, dz that were measured, sigma",
        )
    columns = [name for name, si in table.units.items() if si != "rad"]  # rotary axes: the structure is at angle zero
    axes = tuple(name for name in columns if name not in (*_DISPLACEMENT, "sigma"))
    for name in columns:
        if table.units[name] != "m":
            raise LogError(
                f"'{name}' is in {table.units[name]}", str(path), "lengths are in um, mm or m: 'x [mm]', 'dx [um]'"
            )
    n = len(table.time)
    if "sigma" in table.columns and np.any(table.columns["sigma"] <= 0.0):
        line = int(np.argmax(table.columns["sigma"] <= 0.0)) + 2
        raise LogError(
            "sigma is not positive",
            f"{path} (line {line})",
            "give a standard deviation, or an empty cell",
        )
    return Tcp(
        time=_relative(table, zero, path),
        axes=axes,
        position=np.column_stack([table.columns[a] for a in axes]) if axes else np.zeros((n, 0)),
        displacement=np.column_stack([table.columns.get(d, np.full(n, np.nan)) for d in _DISPLACEMENT]),
        sigma=table.columns.get("sigma"),
        naive=table.naive,
        angle={name: table.columns[name] for name, si in table.units.items() if si == "rad"},
    )
