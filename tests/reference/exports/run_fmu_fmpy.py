"""An FMU of `twin export` over a run folder, by FMPy: python run_fmu_fmpy.py machine.fmu RUN result.csv

Rows of loads.csv are held, positions move straight to the next row: besides its value each position has an input
NAME_rate, its change per second. Needs fmpy and NumPy, nothing else; units are those of the header.
"""

from __future__ import annotations

import csv
import math
import sys
from pathlib import Path

import fmpy
import numpy as np

UNITS = {"mm": 1e-3, "um": 1e-6, "m/min": 1 / 60, "mm/min": 1e-3 / 60, "mm/s": 1e-3, "1/min": 1 / 60, "rpm": 1 / 60,
         "deg": math.pi / 180, "min": 60.0, "h": 3600.0, "kW": 1e3, "kN": 1e3, "%": 0.01,
         "l/min": 1e-3 / 60}  # fmt: skip


def loads(folder: Path) -> dict[str, np.ndarray]:
    """Columns of loads.csv by name, SI; empty cells are NaN, which an FMU takes as the value before."""
    with open(folder / "loads.csv", encoding="utf-8", newline="") as f:
        header, *rows = list(csv.reader(f))
    table = {}
    for k, head in enumerate(header):
        name, _, unit = head.partition(" [")
        cells = np.array([float(row[k]) if row[k].strip() else np.nan for row in rows])
        table[name] = cells * UNITS.get(unit.rstrip("]"), 1.0)
    return table


def inputs(columns: dict[str, np.ndarray], names: list[str]) -> np.ndarray:
    """A structured array as FMPy takes it, time from zero; the last row holds."""
    time = columns["time"] - columns["time"][0]
    table = np.zeros(len(time), dtype=[("time", float), *((name, float) for name in names)])
    table["time"] = time
    for name in names:
        if name.endswith("_rate") and name.removesuffix("_rate") in columns:
            position = columns[name.removesuffix("_rate")]
            table[name] = np.append(np.diff(position) / np.diff(time), 0.0)
        else:
            table[name] = columns[name]
    return table


def simulate(fmu: Path, folder: Path, initial: float, step: float = 60.0) -> np.ndarray:
    """Outputs at the end of every communication step of `step` [s]; initial: degC of the whole machine."""
    description = fmpy.read_model_description(str(fmu))
    columns = loads(folder)
    known = [v.name for v in description.modelVariables if v.causality == "input"]
    table = inputs(columns, [n for n in known if n in columns or n.removesuffix("_rate") in columns])
    steps = max(1, math.ceil((table["time"][-1] - 1e-9) / step))
    result = fmpy.simulate_fmu(str(fmu), stop_time=steps * step, output_interval=step, input=table,
                               start_values={"T_initial": initial})  # fmt: skip
    wanted = np.arange(steps + 1) * step  # FMPy also stops wherever an input changes
    return result[np.searchsorted(result["time"], wanted - 1e-6 * step)]


if __name__ == "__main__":
    result = simulate(Path(sys.argv[1]), Path(sys.argv[2]), float(sys.argv[4]) if len(sys.argv) > 4 else 22.0)
    np.savetxt(sys.argv[3], result, delimiter=",", header=",".join(result.dtype.names or ()), comments="")
