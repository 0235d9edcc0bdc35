"""What the head of every control table says: of what it is, its sign, and what it leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from twin.errors import TwinError
from twin.export.axis_offsets import Left, told
from twin.export.options import ExportOptions
from twin.rom.artefact import Artefact
from twin.run.correction import PoseErrors
from twin.run.correction_axes import axis_jacobian
from twin.run.correction_file import read_pose_errors
from twin.run.correction_struts import in_struts

SIGN = (
    "sign: the values are added to the nominal axis position; they are minus the error (+10 um error: -10 um).",
    "Check it with one known value of 10 um on your control before use: some versions and settings subtract.",
)


@dataclass(frozen=True)
class Source:
    """The errors a table is made of."""

    errors: PoseErrors
    jacobian: np.ndarray  # (3, n_axes) of `twin.run.correction_axes`
    machine: str
    artefact: str  # sha256 of the model
    time: float  # s since the start of the run


def source_of(artefact: Artefact, options: ExportOptions) -> Source:
    """The errors in the result that the options name.

    Raises TwinError where none is named, for results of other artefacts and times outside the run, and ModelError for
    machines that have no axis to correct with.
    """
    if options.result is None:
        raise TwinError("a table is made of a result", "--result", "name the folder of `twin run -o`")
    if not artefact.model.moves:
        raise TwinError("no temperature moves its tool", artefact.model.name, "there is nothing to correct")
    errors, time = read_pose_errors(options.result, artefact.digest, options.time)
    jacobian = axis_jacobian(artefact, errors.axes)
    errors = in_struts(replace(errors, model=artefact.model))
    return Source(errors, jacobian, artefact.model.name, artefact.digest, time)


def summary(path: Path, found: Left) -> tuple[str, ...]:
    """What a command says of a table."""
    return (str(path), *(f"  {line}" for line in told(found)), *SIGN)


def head(source: Source, found: Left, loses: str) -> list[str]:
    """Lines without comment marks."""
    return [
        f"machine {source.machine}, after {source.time / 3600.0:g} h of the run, model sha256 {source.artefact[:16]}",
        *SIGN,
        f"cannot express: {loses}",
        "at the poses and at places drawn evenly over the workspace, by the reduced model:",
        *(f"  {line}" for line in told(found)),
    ]


def commented(mark: str, lines: Sequence[str]) -> list[str]:
    """The lines behind a comment mark."""
    return [f"{mark} {line}" for line in lines]
