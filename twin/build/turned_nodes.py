"""Which nodes of a body's surface its rotary axes turn."""

from __future__ import annotations

import numpy as np

from twin.build.mesh import BodyMesh
from twin.machine.description import Machine
from twin.machine.turning import turning_axes


def turned_nodes(machine: Machine, body: BodyMesh) -> np.ndarray | None:
    """(n, m) bool: by the n axes in the order of `turning_axes`, of the vertices of the surface part by part, as
    `SurfaceMesh` has them. None of machines without such axes.
    """
    turning = turning_axes(machine)
    if not turning:
        return None
    counts = [len(np.unique(part.mesh.facets[:, part.mesh.boundary_facets()])) for part in body.parts]
    return np.array([np.repeat([part.name in turn.parts for part in body.parts], counts) for turn in turning])
