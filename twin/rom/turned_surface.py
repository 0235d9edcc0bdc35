"""The surface of a machine where its rotary axes stand, for pictures: what they turn, turned with its displacements."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.rom.field_file import SurfaceField
from twin.rom.model import MachineModel
from twin.rom.parallel import rotated
from twin.rom.turning import Turn


def surface_turns(model: MachineModel, fields: Sequence[SurfaceField]) -> tuple[Turn, ...]:
    """The axes that turn nodes of the surface, in the order of `SurfaceField.turned`; none in older artefacts."""
    system = getattr(model.structure, "system", None)
    return system.turns if system is not None and all(f.turned is not None for f in fields) else ()


def turned_surface(
    turns: Sequence[Turn], field: SurfaceField, angles: np.ndarray, displacement: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray | None]:
    """Nodes (m, 3) [m] with the axes at angles (n,) [rad], linear ones at zero, and their displacements (m, 3) [m].

    displacement: with the angles at zero; what is turned takes it along, as seen from its bearing.
    """
    points, moved = field.nodes.copy(), None if displacement is None else displacement.copy()
    if field.turned is None or not len(angles):  # older artefacts and results
        return points, moved
    for turn, angle, own in zip(turns[::-1], angles[::-1], field.turned[::-1], strict=True):  # the outermost first
        R = rotated(angle * turn.direction)
        if angle:
            points[own] = turn.point + (points[own] - turn.point) @ R.T
        if angle and moved is not None:
            moved[own] = moved[own] @ R.T
    return points, moved
