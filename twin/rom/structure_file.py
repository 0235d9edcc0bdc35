"""The elastic structure in an artefact: the group `structure`, flexibilities as datasets and the rest as JSON.

The JSON holds dataclasses field by field, arrays as their shape and their numbers in C order. Numbers are written so
that reading gives the same bits again.
"""

from __future__ import annotations

import json
from dataclasses import fields, is_dataclass, replace
from typing import Any

import h5py
import numpy as np

from twin.rom.elastic_structure import ElasticStructure, PortFlexibility
from twin.rom.from_json import filled
from twin.rom.hdf5_file import floats, member, put, scale, text
from twin.rom.lumped_structure import LumpedStructure

KINDS = {"meshed": ElasticStructure, "lumped": LumpedStructure}


def write_structure(group: h5py.Group, structure: ElasticStructure | LumpedStructure) -> None:
    """Fill an empty group."""
    bare = structure
    if isinstance(structure, ElasticStructure):
        bare = replace(structure, bodies=())
        scale(group, "rigid_motion", ("x", "y", "z", "rx", "ry", "rz"), "", "about the machine origin")
        flexible = group.create_group("bodies")
        for body in structure.bodies:
            own = flexible.create_group(body.name)
            scale(own, "elastic_port", np.arange(len(body.F)), "", "as the first elastic inputs of the body")
            put(own, "F", body.F, "m/N", ("elastic_port", "elastic_port"), "displacement per force; rad, N m likewise")
            put(own, "R", body.R, "1", ("elastic_port", "rigid_motion"), "displacement per translation, rotation")
    (kind,) = (name for name, one in KINDS.items() if type(structure) is one)
    put(group, "json", json.dumps({"kind": kind, **_plain(bare)}), "", (), "springs, scales, tool centre point (JSON)")


def read_structure(group: h5py.Group, bodies: tuple[str, ...]) -> ElasticStructure | LumpedStructure:
    """The structure of the model with these bodies.

    Raises KeyError where something is missing or does not fit, ValueError or TypeError for damaged JSON.
    """
    told = json.loads(text(group, "json", "structure"))
    kind = told.pop("kind", None) if isinstance(told, dict) else None
    if kind not in KINDS:
        raise KeyError(f"'structure/json' is of no kind of {', '.join(KINDS)}")
    structure = filled(KINDS[kind], told, "structure/json")
    if isinstance(structure, LumpedStructure):
        return structure
    assert isinstance(structure, ElasticStructure)
    flexible = tuple(_flexibility(group, name) for name in bodies)
    for body, n in zip(flexible, np.diff(structure.system.offsets), strict=True):
        if body.F.shape != (n, n) or body.R.shape != (n, 6):
            raise KeyError(f"'structure/{body.name}' has matrices that do not fit")
    return replace(structure, bodies=flexible)


def _flexibility(group: h5py.Group, name: str) -> PortFlexibility:
    where = f"structure/bodies/{name}"
    own = member(group, f"bodies/{name}", "structure")
    return PortFlexibility(name, floats(own, "F", where), floats(own, "R", where))


def _plain(value: Any) -> Any:
    """JSON values of dataclasses, arrays, tuples and numbers."""
    if isinstance(value, np.ndarray):
        return {"shape": list(value.shape), "values": value.ravel().tolist()}
    if is_dataclass(value):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    return [_plain(v) for v in value] if isinstance(value, tuple) else value
