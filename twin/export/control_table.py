"""What the head of every control table says: of what it is, its sign, and what it leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.export.axis_offsets import Left, told
from twin.run.correction import PoseErrors

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
