"""The state space and the affine terms as a NumPy archive, readable without pickle."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from twin.atomic import atomic_path
from twin.export.matrices import body_arrays, described, machine_arrays, state_space_arrays
from twin.export.operating_point import OperatingPoint, chosen
from twin.export.options import ExportOptions
from twin.export.state_space import StateSpace, state_space
from twin.rom.artefact import Artefact


def export_npz(artefact: Artefact, path: Path, options: ExportOptions) -> tuple[str, ...]:
    """The format `npz`: `write_npz` at the operating point that the options ask for."""
    return described(path, write_npz(path, artefact, chosen(artefact, options)))


def write_npz(path: Path, artefact: Artefact, point: OperatingPoint) -> StateSpace:
    """Write `path`: E, A, B, C, D with names and units, and `affine/BODY/NAME` of every body; indices count from 0.

    Raises TwinError if the file cannot be written.
    """
    space = state_space(artefact.model, point)
    arrays = {**state_space_arrays(space), **machine_arrays(artefact, point)}
    arrays["bodies"] = np.array([body.name for body in artefact.model.bodies])
    for body in artefact.model.bodies:
        arrays |= {f"affine/{body.name}/{name}": value for name, value in body_arrays(body).items()}
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, **arrays)
    return space
