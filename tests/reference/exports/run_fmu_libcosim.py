"""An FMI 2.0 FMU of `twin export` over a run folder, by libcosim: python run_fmu_libcosim.py machine.fmu RUN result.csv

Needs libcosimpy, fmpy (which reads names and units) and NumPy. One master step per row of loads.csv.
"""

from __future__ import annotations

import sys
from pathlib import Path

import fmpy
import numpy as np
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimManipulator import CosimManipulator
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

from tests.reference.exports.run_fmu_fmpy import inputs, loads


def simulate(fmu: Path, folder: Path, initial: float) -> dict[str, np.ndarray]:
    """Time and outputs after every row of equal length; initial: degC of the whole machine."""
    variables = fmpy.read_model_description(str(fmu)).modelVariables
    columns = loads(folder)
    known = [v.name for v in variables if v.causality == "input"]
    table = inputs(columns, [n for n in known if n in columns or n.removesuffix("_rate") in columns])
    spacing = float(table["time"][1] - table["time"][0])
    reference = {v.name: v.valueReference for v in variables}
    driven = list(table.dtype.names or ())[1:]
    outputs = [v.name for v in variables if v.causality == "output"]

    execution = CosimExecution.from_step_size(step_size=round(spacing * 1e9))
    slave = execution.add_local_slave(CosimLocalSlave(fmu_path=str(fmu), instance_name="machine"))
    manipulator, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(manipulator=manipulator)
    execution.add_observer(observer=observer)
    execution.real_initial_value(slave, reference["T_initial"], initial)
    rows = []
    for row in table:
        manipulator.slave_real_values(slave, [reference[n] for n in driven], [float(row[n]) for n in driven])
        if not execution.step():
            raise RuntimeError(f"step at {row['time']:g} s failed")
        rows.append(list(observer.last_real_values(slave, [reference[n] for n in outputs])))
    values = np.array(rows)
    found = {"time": spacing * np.arange(1, len(rows) + 1)}
    return found | {name: values[:, k] for k, name in enumerate(outputs)}


if __name__ == "__main__":
    result = simulate(Path(sys.argv[1]), Path(sys.argv[2]), float(sys.argv[4]) if len(sys.argv) > 4 else 22.0)
    np.savetxt(sys.argv[3], np.column_stack(list(result.values())), delimiter=",", header=",".join(result), comments="")
