"""What an export may be told besides its artefact and file; each format reads what it needs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True)
class ExportOptions:
    """Options of all formats. Those a format does not know are refused by `twin.face.export.export`."""

    precision: Literal["double", "single"] = "double"  # of the C code's numbers
    run: Path | None = None  # C: run folder on which the error against `twin run` is measured
    poses: bool = False  # FMUs: TCP errors at all poses among the outputs
    result: Path | None = None  # folder of `twin run`, where a format is of results
    time: float | None = None  # s since the start of the run; None: its end
    at: str | None = None  # axes of a state space, "x=100 mm, y=0 mm"; others as in the result, or at zero
    frames: int = 60  # ParaView files: so many times of the run, evenly spaced; 60 of the five-axis machine are 30 MB
    field: bool = False  # ParaView files: the volume by the full model, not the surface alone
