"""A correction as a page shows it: offsets of every axis over the grid of poses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from twin.errors import TwinError
from twin.page.packed import packed
from twin.rom.artefact import Artefact
from twin.run.correction_file import read_correction


def correction_told(artefact: Artefact, path: Path) -> dict[str, Any] | None:
    """The correction.json of `twin correction`, evaluated at the poses; None where there is none for these axes.

    Raises TwinError for a damaged file.
    """
    if not path.is_file():
        return None
    correction = read_correction(path)
    model = artefact.model
    names = tuple(a.name for a in correction.polynomial.axes)
    if names != model.pose_axes:
        raise TwinError(
            f"corrects axes {', '.join(names)}, not those of the poses", str(path), "make it again, or move it"
        )
    poses = model.poses[: len(model.poses) - model.scattered]
    errors = correction.polynomial(poses)
    offsets = errors @ correction.offset_per_error.T
    degrees = ", ".join(f"{a.name} {a.degree}" for a in correction.polynomial.axes)
    return {
        "words": f"{path.name}: polynomial of degree {degrees}; added to the nominal position of each axis",
        "axes": list(names),
        "offsets": packed(offsets),
        "largest_um": (1e6 * np.abs(offsets).max(axis=0)).tolist(),
    }
