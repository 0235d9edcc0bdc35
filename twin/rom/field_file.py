"""The temperatures and displacements of a body's surface in an artefact, for pictures."""

from __future__ import annotations

from dataclasses import dataclass

import h5py
import numpy as np

from twin.rom.hdf5_file import floats, integers, put, scale


@dataclass(frozen=True)
class SurfaceField:
    """A body on its surface mesh, for pictures: T - T_ref = basis @ x, and how it moves (`twin.rom.surface_motion`)."""

    body: str
    nodes: np.ndarray  # (m, 3) m, machine coordinates at axis positions zero
    triangles: np.ndarray  # (t, 3) int
    basis: np.ndarray  # (m, n) K per unit of state
    displacement: np.ndarray | None = None  # (m, 3, n) m per unit of state, of the body on isostatic supports
    flexibility: np.ndarray | None = None  # (m, 3, p) m/N per force on its elastic ports
    turned: np.ndarray | None = None  # (k, m) bool: which nodes each of the k rotary axes turns; None: not known


def write_field(group: h5py.Group, field: SurfaceField) -> None:
    """Fill an empty group."""
    for dim, size in (("node", len(field.nodes)), ("triangle", len(field.triangles)), ("corner", 3),
                      ("coordinate", 3), ("state", field.basis.shape[1])):  # fmt: skip
        scale(group, dim, np.arange(size))
    put(group, "nodes", np.asarray(field.nodes, dtype=float), "m", ("node", "coordinate"))
    put(group, "triangles", np.asarray(field.triangles, dtype=np.int32), "", ("triangle", "corner"))
    put(group, "basis", np.asarray(field.basis, dtype=np.float32), "1", ("node", "state"))
    if field.displacement is not None and field.flexibility is not None:
        scale(group, "elastic_port", np.arange(field.flexibility.shape[2]))
        moved, pushed = (np.asarray(a, dtype=np.float32) for a in (field.displacement, field.flexibility))
        put(group, "displacement", moved, "m/K", ("node", "component", "state"))
        put(group, "flexibility", pushed, "m/N", ("node", "component", "elastic_port"))
    if field.turned is not None:
        scale(group, "rotary_axis", np.arange(len(field.turned)))
        put(group, "turned", field.turned.astype(np.int32), "", ("rotary_axis", "node"))


def read_field(group: h5py.Group, body: str, n: int, turning: int) -> SurfaceField:
    """The field of a body of n states of a machine with so many axes that turn.

    Raises KeyError where it does not fit the body, or its triangles its nodes.
    """
    where = f"fields/{body}"
    nodes, basis = floats(group, "nodes", where), floats(group, "basis", where, bits=32)
    triangles = integers(group, "triangles", where, bits=32)
    if nodes.shape != (len(nodes), 3) or basis.shape != (len(nodes), n) or triangles.shape != (len(triangles), 3):
        raise KeyError(f"'{where}' has nodes, triangles and basis that do not fit each other")
    if triangles.size and not 0 <= triangles.min() <= triangles.max() < len(nodes):
        raise KeyError(f"'{where}/triangles' name nodes that are not there")
    turned = integers(group, "turned", where, bits=32).astype(bool) if "turned" in group else None
    if turned is not None and turned.shape != (turning, len(nodes)):
        raise KeyError(f"'{where}/turned' does not fit the rotary axes and nodes")
    if "displacement" not in group:  # optional, with the flexibility
        return SurfaceField(body, nodes, triangles, basis, turned=turned)
    moved, pushed = (floats(group, name, where, bits=32) for name in ("displacement", "flexibility"))
    if moved.shape != (len(nodes), 3, n) or pushed.shape[:2] != (len(nodes), 3) or pushed.ndim != 3:
        raise KeyError(f"'{where}' has a displacement and a flexibility that do not fit its nodes")
    return SurfaceField(body, nodes, triangles, basis, moved, pushed, turned)
