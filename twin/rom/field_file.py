"""The temperature field of a body's surface in an artefact, for pictures."""

from __future__ import annotations

from dataclasses import dataclass

import h5py
import numpy as np

from twin.rom.hdf5_file import floats, integers, put, scale


@dataclass(frozen=True)
class SurfaceField:
    """The temperature field of a body on its surface mesh, for pictures: T - T_ref = basis @ x."""

    body: str
    nodes: np.ndarray  # (m, 3) m, machine coordinates at axis positions zero
    triangles: np.ndarray  # (t, 3) int
    basis: np.ndarray  # (m, n) K per unit of state


def write_field(group: h5py.Group, field: SurfaceField) -> None:
    """Fill an empty group."""
    for dim, size in (("node", len(field.nodes)), ("triangle", len(field.triangles)), ("corner", 3),
                      ("coordinate", 3), ("state", field.basis.shape[1])):  # fmt: skip
        scale(group, dim, np.arange(size))
    put(group, "nodes", np.asarray(field.nodes, dtype=float), "m", ("node", "coordinate"))
    put(group, "triangles", np.asarray(field.triangles, dtype=np.int32), "", ("triangle", "corner"))
    put(group, "basis", np.asarray(field.basis, dtype=np.float32), "1", ("node", "state"))


def read_field(group: h5py.Group, body: str, n: int) -> SurfaceField:
    """The field of a body of n states. Raises KeyError where it does not fit the body, or its triangles its nodes."""
    where = f"fields/{body}"
    nodes, basis = floats(group, "nodes", where), floats(group, "basis", where, bits=32)
    triangles = integers(group, "triangles", where, bits=32)
    if nodes.shape != (len(nodes), 3) or basis.shape != (len(nodes), n) or triangles.shape != (len(triangles), 3):
        raise KeyError(f"'{where}' has nodes, triangles and basis that do not fit each other")
    if triangles.size and not 0 <= triangles.min() <= triangles.max() < len(nodes):
        raise KeyError(f"'{where}/triangles' name nodes that are not there")
    return SurfaceField(body, nodes, triangles, basis)
