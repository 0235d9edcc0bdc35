"""Errors of a platform on struts, as lengths of its struts: what the control of a parallel machine corrects.

The TCP error w at a pose is J e of the strut errors e, by how much each strut is too long (`rom.lumped_structure`). The
offsets are -e = -J^-1 (w, tilt): six struts take up all six, and what `J` does to them at every pose is known here.
So a correction of struts is fitted to e, with the unit matrix in place of J.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.errors import ModelError
from twin.rom.lumped_structure import LumpedStructure
from twin.rom.model import MachineModel
from twin.rom.tcp import by_body, inputs
from twin.run.correction import PoseErrors


@dataclass(frozen=True)
class StrutErrors(PoseErrors):
    """Errors (m, 6) [m] of strut lengths instead of the TCP's."""

    def at(self, position: np.ndarray) -> np.ndarray:
        """(m, 6) [m] at strut positions (m, 6) [m]; outside the poses at the nearest of them."""
        low, high = [g[0] for g in self.grid], [g[-1] for g in self.grid]
        assert self.model is not None
        assert self.state is not None
        return strut_errors(self.model, self.state, np.clip(position, low, high))

    @property
    def tilt(self) -> None:
        """Six struts take up a tilt as they do a displacement: nothing is left to be told."""
        return


def on_struts(model: MachineModel) -> bool:
    """Whether the struts of a model carry a platform."""
    return isinstance(model.structure, LumpedStructure) and model.structure.platform is not None


def in_struts(errors: PoseErrors) -> PoseErrors:
    """The errors in strut lengths where struts carry a platform, else as they are.

    Raises ModelError for a result without states.
    """
    model = errors.model
    if model is None or not on_struts(model):
        return errors
    if errors.state is None:
        raise ModelError("the result holds no states", model.name, "run it again: strut errors are computed from them")
    tcp = strut_errors(model, errors.state, errors.poses)
    return StrutErrors(errors.axes, errors.grid, errors.poses, tcp, model, errors.state)


def strut_errors(model: MachineModel, state: np.ndarray, position: np.ndarray) -> np.ndarray:
    """By how much the struts are too long (m, 6) [m] at a state (N,) and strut positions (m, 6) [m]."""
    parts = zip(strut_error_rows(model, position), by_body(model, state), strict=True)
    return np.sum([rows @ x for rows, x in parts], axis=0)


def strut_error_rows(model: MachineModel, position: np.ndarray) -> tuple[np.ndarray, ...]:
    """Per body (m, 6, n_b): `strut_errors` at strut positions (m, 6) [m] per coordinate of the artefact."""
    structure = model.structure
    assert isinstance(structure, LumpedStructure)
    by_position = zip(*(structure.strut_error_rows(place) for place in position), strict=True)
    return tuple(np.array(rows) @ inputs(model, b) for b, rows in enumerate(by_position))
