"""Where measured data of real machines lie, which are no part of the project."""

from __future__ import annotations

import os
from pathlib import Path

VARIABLE = "TWIN_MEASURED_DATA"
ROOT = Path(__file__).parents[1]


def measured_data(name: str) -> Path | None:
    """The folder `name` among the measured data; None where there is none.

    Looked for below the folder that TWIN_MEASURED_DATA names, else below ../shared/data beside the repository.
    """
    below = os.environ.get(VARIABLE)
    folder = (Path(below) if below else ROOT.parent / "shared" / "data") / name
    return folder if folder.is_dir() else None
