"""Structured tetrahedra for parts given as boxes: machines and tests that need no mesher."""

from __future__ import annotations

import numpy as np
from skfem import MeshTet1

from twin.errors import DescriptionError
from twin.machine.description import Box


def box_mesh(box: Box, where: str = "box") -> tuple[MeshTet1, dict[str, np.ndarray]]:
    """Tetrahedra of a box and the facets of its six surfaces x_min .. z_max.

    Raises DescriptionError for a size or division that is not positive.
    """
    if min(box.size) <= 0 or min(box.divisions) < 1:
        raise DescriptionError(
            f"size {box.size} m with divisions {box.divisions}", where, "sizes must be > 0 and divisions >= 1"
        )
    ends = [(o, o + s) for o, s in zip(box.origin, box.size, strict=True)]
    x, y, z = (np.linspace(low, high, n + 1) for (low, high), n in zip(ends, box.divisions, strict=True))
    mesh = MeshTet1.init_tensor(x, y, z)
    outer = mesh.boundary_facets()
    corners = mesh.p[:, mesh.facets[:, outer]]  # (3, 3, n)
    surfaces = {}
    for axis, (name, (low, high)) in enumerate(zip("xyz", ends, strict=True)):
        for side, value in (("min", low), ("max", high)):
            on = np.abs(corners[axis] - value).max(axis=0) <= 1e-9 * (high - low)
            surfaces[f"{name}_{side}"] = outer[on]
    return mesh, surfaces
