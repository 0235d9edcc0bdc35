"""A finished run to be served: its page, and its last step for OPC UA."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from twin.page.finished import finished_told
from twin.pictures.result import read_result
from twin.rom.artefact import Artefact
from twin.serve.now import Now


class FinishedRun:
    """Read once; later changes of the files are not seen."""

    def __init__(self, artefact: Artefact, folder: Path):
        """Raises TwinError where the folder holds no result of this artefact."""
        self.artefact, self.folder = artefact, Path(folder)
        self._content = finished_told(artefact, self.folder)
        result = read_result(self.folder, artefact)
        count = len(artefact.model.poses) - artefact.model.scattered if artefact.model.moves else 0
        raised = np.flatnonzero(result.flags[-1:].any(axis=0))
        self._now = Now(
            time=3600.0 * float(result.hours[-1]), step=len(result.hours) - 1,
            temperatures=tuple(result.temperature[-1].tolist()), tcp=result.tcp[-1, :count],
            actual=result.tcp_actual[-1] if artefact.model.moves else np.full(3, math.nan),
            trust=self._content["trust"]["line"], mode="finished", words="the last step of a finished run",
            age=math.nan, balance=math.nan, flags=tuple(result.flag_names[k] for k in raised),
        )  # fmt: skip

    def content(self) -> dict[str, Any]:
        return self._content

    def now(self) -> Now:
        return self._now
