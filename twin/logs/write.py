"""Writing a run folder, whole or not at all."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np

from twin.atomic import atomic_folder, check_folder
from twin.errors import LogError
from twin.logs.run import Run, Table, Tcp

_FILES = {"run.toml", "loads.csv", "temperatures.csv", "tcp.csv"}


def write_run(folder: Path, run: Run) -> None:
    """Write `run` to `folder` in the format that `read_run` reads: SI and degC, TCP displacements in um.

    Numbers keep nine digits. A run folder that only holds computed tables is replaced; `run.folder` is not looked at.
    Raises LogError where `folder` holds measured data or other files, TwinError where it cannot be written.
    """
    folder = Path(folder)
    refuse_to_destroy(folder)
    with atomic_folder(folder) as new:
        (new / "run.toml").write_text(_facts(run), encoding="utf-8")
        write_table(new / "loads.csv", run.loads)
        if run.temperatures is not None:
            write_table(new / "temperatures.csv", run.temperatures)
        if run.tcp is not None:
            write_tcp(new / "tcp.csv", run.tcp)


def refuse_to_destroy(folder: Path) -> None:
    """Raises LogError where `folder` is no place for a computed run, TwinError where it cannot be written."""
    if folder.exists() and not folder.is_dir():
        raise LogError("is a file, not a folder", str(folder), "choose another folder with -o")
    check_folder(folder)
    if not folder.exists():
        return
    others = sorted({p.name for p in folder.iterdir()} - _FILES)
    if others:
        raise LogError(f"holds other files: {', '.join(others[:5])}", str(folder), "choose another folder with -o")
    try:
        facts = tomllib.loads((folder / "run.toml").read_text(encoding="utf-8"))
        computed = facts.get("synthetic")
    except (OSError, ValueError):
        computed = not any(folder.iterdir())  # an empty folder may be used
    if not computed:
        raise LogError(
            "holds measured data", str(folder), "choose another folder with -o; measured runs are never replaced"
        )


def _facts(run: Run) -> str:
    lines = [f"start = {run.start.isoformat()}" if run.start else 'start = "unknown"']
    for key in ("zone", "provenance", "machine"):
        if value := getattr(run, key):
            lines.append(f"{key} = {json.dumps(value, ensure_ascii=False)}")
    lines += [f"sampling = {run.sampling!r}"] if run.sampling else []
    lines += [f"initial_temperature = {run.initial_temperature!r}"] if run.initial_temperature is not None else []
    lines += ['initial_temperature = "steady"'] if run.steady_start else []
    lines.append(f"synthetic = {json.dumps(list(run.synthetic))}")
    if run.tcp_reference != "absolute":
        lines.append(f"tcp_reference = {json.dumps(run.tcp_reference)}")
    if run.segments:
        rows = [
            f"  {{ name = {json.dumps(s.name, ensure_ascii=False)}, start = {s.start!r}, end = {s.end!r} }},"
            for s in run.segments
        ]
        lines += ["segments = [", *rows, "]"]
    return "\n".join(lines) + "\n"


def write_table(path: Path, table: Table) -> None:
    """One table of a run folder, not atomically: the caller owns `path`."""
    headers = ["time [s]", *(f"{name} [{table.units[name]}]" for name in table.columns)]
    _write(path, headers, np.column_stack([table.time, *table.columns.values()]))


def write_tcp(path: Path, tcp: Tcp) -> None:
    """The tcp.csv of a run folder, positions in mm and displacements in um; not atomically."""
    headers = ["time [s]", *(f"{a} [mm]" for a in tcp.axes), *(f"{a} [deg]" for a in tcp.angle)]
    measured = np.isfinite(tcp.displacement).any(axis=0) if len(tcp.time) else np.ones(3, dtype=bool)
    headers += [f"d{'xyz'[k]} [um]" for k in np.flatnonzero(measured)]
    angles = [np.rad2deg(values)[:, None] for values in tcp.angle.values()]
    columns = [tcp.time[:, None], tcp.position * 1e3, *angles, tcp.displacement[:, measured] * 1e6]
    if tcp.sigma is not None:
        headers.append("sigma [um]")
        columns.append(tcp.sigma[:, None] * 1e6)
    _write(path, headers, np.hstack(columns))


def _write(path: Path, headers: list[str], rows: np.ndarray) -> None:
    with path.open("w", encoding="utf-8", newline="\n") as f:
        f.write(",".join(headers) + "\n")
        np.savetxt(f, rows, fmt="%.9g", delimiter=",")
