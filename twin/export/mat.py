"""The state space and the affine terms as a MATLAB file of version 5, which Octave, SciPy and pyMOR read, too."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat

from twin.atomic import atomic_path
from twin.export.c.law_code import law_lines
from twin.export.matrices import body_arrays, described, machine_arrays, state_space_arrays
from twin.export.operating_point import OperatingPoint, chosen
from twin.export.options import ExportOptions
from twin.export.state_space import StateSpace, state_space
from twin.rom.artefact import Artefact

LAST = ("A",)  # of a body: the stack of terms comes last in MATLAB, A(:, :, k)


def export_mat(artefact: Artefact, path: Path, options: ExportOptions) -> tuple[str, ...]:
    """The format `mat`: `write_mat` at the operating point that the options ask for."""
    return described(path, write_mat(path, artefact, chosen(artefact, options)))


def write_mat(path: Path, artefact: Artefact, point: OperatingPoint) -> StateSpace:
    """Write `path`: E, A, B, C, D with names and units, `machine`, cells `affine` with a struct per body, and `log`:
    what a log drives the machine with, as JSON, and its laws as lines of Octave.

    Names are cell arrays, indices count from 1. Raises TwinError if the file cannot be written.
    """
    space = state_space(artefact.model, point)
    content = {name: _cells(value) for name, value in state_space_arrays(space).items()}
    content["machine"] = {name: _cells(value) for name, value in machine_arrays(artefact, point).items()}
    content["affine"] = np.array([_body(body.name, body_arrays(body)) for body in artefact.model.bodies], dtype=object)
    load = artefact.model.load_model
    content["log"] = {
        "load_model": json.dumps(load.to_json()),
        "source_laws": _cells(np.array([law_lines(source.use) for source in load.sources])),
        "film_laws": _cells(np.array([law_lines(film.use) for film in load.films])),
        "substeps": float(artefact.certificate.get("substeps", 1)),
    }
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        savemat(file, content, oned_as="column", long_field_names=True)
    return space


def _body(name: str, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    def turned(key: str, value: np.ndarray) -> np.ndarray:
        if value.dtype.kind == "i":
            return np.asarray(value + 1, dtype=float)
        return np.moveaxis(value, 0, -1) if key in LAST else value

    return {"name": name, **{key: turned(key, value) for key, value in arrays.items()}}


def _cells(value: Any) -> Any:
    """Text arrays as cell arrays: names of unequal length stay what they are."""
    if isinstance(value, np.ndarray) and value.dtype.kind == "U":
        cells = np.empty(len(value), dtype=object)
        cells[:] = value.tolist()
        return cells
    return value
