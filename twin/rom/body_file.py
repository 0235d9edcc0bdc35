"""A body in an artefact: its group of matrices, indices and members, checked for shape and type on reading."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np

from twin.rom.hdf5_file import floats, integers, put, scale, texts
from twin.rom.model import AffineBody

# Dataset of a body -> (unit, dimensions). `equation` counts rows, `state` columns: they differ for oblique projections.
_MATRICES: dict[str, tuple[str, tuple[str, ...]]] = {
    "E": ("J/K", ("equation", "state")),
    "A0": ("W/K", ("equation", "state")),
    "A": ("m^2", ("theta", "equation", "state")),
    "M": ("m^2", ("equation", "theta")),
    "H": ("m^3", ("equation", "theta")),
    "raised": ("m^2", ("pose_axis", "equation", "theta")),
    "B": ("1", ("equation", "sources")),
    "B_out": ("1", ("state", "sources")),
    "P": ("1", ("equation", "ports")),
    "P_out": ("1", ("state", "ports")),
    "C": ("1", ("sensors", "state")),
    "G": ("m/K", ("pose", "component", "state")),
    "one": ("K", ("state",)),
    "energy": ("J/K", ("state",)),
    "E_members": ("J/K", ("member", "equation", "state")),
    "G_members": ("m/K", ("member", "pose", "component", "state")),
    "W": ("m/K", ("elastic_input", "state")),
    "W_members": ("m/K", ("member", "elastic_input", "state")),
}
_OPTIONAL = ("H", "raised", "B_out", "P_out", "E_members", "G_members", "W", "W_members")
_INDICES = {"theta": "theta", "sources": "source", "ports": "port", "sensors": "sensor"}  # into root coordinates


def write_body(group: h5py.Group, body: AffineBody) -> None:
    """Fill an empty group."""
    scale(group, "state", np.arange(body.n), "", "modal coordinates [K]")
    scale(group, "equation", np.arange(body.n), "", "rows")
    if body.members:
        scale(group, "member", body.members, "", "parts, or nodes and bars: shares of E, G and W")
    if body.W is not None:
        scale(group, "elastic_input", np.arange(len(body.W)), "", "what the structure reads of the temperatures")
    for name, root in _INDICES.items():
        scale(group, name, np.array(getattr(body, name), dtype=np.int64), "", f"index of each {root} in /{root}")
    values = {name: getattr(body, name) for name in _MATRICES} | {
        "A": np.array(body.A).reshape(len(body.theta), body.n, body.n)
    }
    for name, (unit, dims) in _MATRICES.items():
        if values[name] is not None:
            put(group, name, np.asarray(values[name], dtype=float), unit, dims)


def read_body(group: h5py.Group, name: str, n_poses: int, n_axes: int) -> AffineBody:
    """The body in a group of the file of a machine with so many poses and linear axes.

    Raises KeyError where a dataset is missing, or is not of the type and shape that docs/artefact.md gives it, or holds
    values that are not finite.
    """
    where = f"bodies/{name}"
    indices: dict[str, Any] = {part: tuple(int(i) for i in integers(group, part, where)) for part in _INDICES}
    members = texts(group, "member", where) if "member" in group else ()
    n, inputs = len(floats(group, "one", where)), len(floats(group, "W", where)) if "W" in group else 0
    sizes = {"equation": n, "state": n, "pose": n_poses, "component": 3, "pose_axis": n_axes, "member": len(members)}
    sizes |= {"elastic_input": inputs} | {kind: len(index) for kind, index in indices.items()}
    values: dict[str, Any] = {}
    for part, (_, dims) in _MATRICES.items():
        if part in _OPTIONAL and part not in group:
            continue
        value = values[part] = floats(group, part, where)
        wanted = tuple(sizes[dim] for dim in dims)
        if value.shape != wanted:
            raise KeyError(f"'{where}/{part}' has shape {value.shape}, not {wanted} ({', '.join(dims)})")
    return AffineBody(name=name, members=members, **(indices | values | {"A": tuple(values["A"])}))
