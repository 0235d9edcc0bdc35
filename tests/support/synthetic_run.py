"""Synthetic artefacts and run folders on disk."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import synthetic

from twin.logs.run import Run, Table
from twin.logs.write import write_run
from twin.rom.artefact import write_artefact
from twin.rom.model import MachineModel


def artefact(path: Path, model: MachineModel) -> Path:
    write_artefact(
        path,
        model,
        certificate={"step": 60.0, "substeps": 1, "finest_step": 15.0, "confidence": 0.95},
        provenance={"command": "synthetic"},
    )
    return path


def run(model: MachineModel, hours: float = 3.0, **changes: np.ndarray) -> Run:
    """A run in memory with the loads of `synthetic.loads`."""
    time, signals = synthetic.loads(model.load_model, hours)
    columns = {s.column: signals[s.name] for s in model.load_model.signals} | changes
    units = {s.column: s.unit for s in model.load_model.signals}
    return Run(Table(time, columns, units), provenance="synthetic", synthetic=("loads",))


def run_folder(path: Path, model: MachineModel, hours: float = 3.0) -> Path:
    write_run(path, run(model, hours))
    return path
