"""FMUs of every shipped machine over its scenario, by FMPy and libcosim: problems found, and distance from twin run."""

from __future__ import annotations

import csv
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import twin
from twin.export.formats import FORMATS
from twin.export.options import ExportOptions
from twin.logs.read import read_run
from twin.rom.artefact import read_artefact
from twin.run.replay import replay
from twin.run.results import Result

ROOT = Path(__file__).parents[1]
SCRIPTS = ROOT / "tests" / "reference" / "exports"  # what docs/exports.md gives users to copy
SCENARIOS = {"five_axis": "experiment_a", "ram_borer": "test_5", "transfer_unit": "working_day",
             "ball_screw_axis": "mixed_load", "spindle_drift": "warm_up", "lathe": "warm_up",
             "linear_gantry": "constant_room", "hexapod": "mixed_paths"}  # fmt: skip
LIMITS = "limits 1e-9 K, 1e-9 um, 0 problems"


def simulated(script: str, fmu: Path, run: Path, initial: float) -> dict[str, np.ndarray]:
    """Columns of what a script to copy writes."""
    target = fmu.with_suffix(".csv")
    command = [sys.executable, str(SCRIPTS / script), str(fmu), str(run), str(target), repr(initial)]
    subprocess.run(command, check=True, capture_output=True, env={**os.environ, "PYTHONPATH": str(ROOT)})
    with target.open(encoding="utf-8", newline="") as f:
        header, *rows = list(csv.reader(f))
    return dict(zip(header, np.array(rows, dtype=float).T, strict=True))


def distance(found: dict[str, np.ndarray], expected: Result) -> str:
    """Largest differences at the ends of steps; sensors in the air have no value at the start."""
    ends, time = expected.time[1:] - expected.time[0], found["time"]
    rows = np.minimum(np.searchsorted(time, ends - 1e-3), len(time) - 1)
    there = np.isclose(time[rows], ends, atol=1e-3)  # libcosim stops where the log does
    rows = rows[there]
    names = [n for n in found if n.startswith("T_")]
    assert names == [f"T_{re.sub(r'[^A-Za-z0-9_]', '_', s)}" for s in expected.sensors]
    T = np.stack([found[n][rows] for n in names], axis=1)
    w = np.stack([found[f"tcp_{c}"][rows] for c in "xyz"], axis=1)
    kelvin = np.abs(T - expected.temperature[1:][there]).max()
    straight = np.abs(expected.angle[1:][there]).max(axis=1, initial=0.0) == 0.0  # an FMU has rotary axes at zero
    um = 1e6 * np.abs(w - expected.tcp_actual[1:][there])[straight].max()
    of = np.ptp(expected.temperature, axis=0).max(initial=0.0), 1e6 * np.abs(expected.tcp_actual).max(initial=0.0)
    return f"{kelvin:.1e} of {of[0]:.1f} K, {um:.1e} of {of[1]:.1f} um over {len(rows)} steps"


def one(machine: str, scenario: str, folder: Path) -> None:
    from fmpy.validation import validate_fmu

    run = ROOT / "models" / machine / "runs" / scenario
    path = folder / f"{machine}.h5"
    twin.build(ROOT / "models" / machine, options=twin.BuildOptions(held_out=1)).save(path)
    artefact = read_artefact(path)
    expected = replay(artefact, read_run(run))
    known = read_run(run).initial_temperature
    initial = float(expected.temperature[0, -1] if known is None else known)
    for version in ("fmu2", "fmu3"):
        fmu = folder / f"{machine}.{version}.fmu"
        began = time.perf_counter()
        FORMATS[version].write(artefact, fmu, ExportOptions())
        seconds = time.perf_counter() - began
        problems = len(validate_fmu(str(fmu)))
        masters = {"FMPy": "run_fmu_fmpy.py"}
        if version == "fmu2":  # libcosim reads FMI 2.0
            masters["libcosim"] = "run_fmu_libcosim.py"
        told = [f"{n}: {distance(simulated(s, fmu, run, initial), expected)}" for n, s in masters.items()]
        head = f"{machine}/{scenario}, {version}: exported in {seconds:.1f} s, {problems} problems"
        print(f"   {head}; {'; '.join(told)}", flush=True)


def main() -> None:
    print(f"   {LIMITS}")
    with tempfile.TemporaryDirectory() as scratch:
        for machine, scenario in SCENARIOS.items():
            one(machine, scenario, Path(scratch))


if __name__ == "__main__":
    main()
