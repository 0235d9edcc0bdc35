"""The elastic structure in an artefact: the group `structure`, flexibilities as datasets and the rest as JSON.

The JSON holds dataclasses field by field, arrays as their shape and their numbers in C order. Numbers are written so
that reading gives the same bits again.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any

import h5py
import numpy as np

from twin.rom.elastic_structure import CutStructure, ElasticStructure, PortFlexibility
from twin.rom.from_json import filled
from twin.rom.hdf5_file import floats, member, put, scale, text
from twin.rom.lumped_structure import LumpedStructure

KINDS = {"meshed": ElasticStructure, "lumped": LumpedStructure}


def write_structure(group: h5py.Group, structure: ElasticStructure | LumpedStructure) -> None:
    """Fill an empty group."""
    bare = structure
    if isinstance(structure, ElasticStructure):
        bare = _without_flexibility(structure)
        scale(group, "rigid_motion", ("x", "y", "z", "rx", "ry", "rz"), "", "about the machine origin")
        _put_flexibilities(group.create_group("bodies"), structure.bodies)
        if structure.cut is not None:
            pieces = [structure.cut.structure.bodies[i] for i in _pieces(structure.cut)]
            _put_flexibilities(group.create_group("pieces"), pieces)
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
    structure = replace(structure, bodies=_flexibilities(group, "bodies", bodies, np.diff(structure.system.offsets)))
    return structure if structure.cut is None else replace(structure, cut=_read_cut(group, structure, bodies))


def _put_flexibilities(group: h5py.Group, bodies: Sequence[PortFlexibility]) -> None:
    for body in bodies:
        own = group.create_group(body.name)
        scale(own, "elastic_port", np.arange(len(body.F)), "", "as the first elastic inputs of the body")
        put(
            own,
            "F",
            body.F,
            "m/N",
            ("elastic_port", "elastic_port"),
            "displacement per force; in rad, N m for rotations",
        )
        put(own, "R", body.R, "1", ("elastic_port", "rigid_motion"), "displacement per translation, rotation")


def _without_flexibility(structure: ElasticStructure) -> ElasticStructure:
    cut = structure.cut
    if cut is not None:
        cut = replace(cut, structure=replace(cut.structure, bodies=()))
    return replace(structure, bodies=(), cut=cut)


def _pieces(cut: CutStructure) -> list[int]:
    """Cut bodies that are not all of their owner."""
    return [i for i, owner in enumerate(cut.owners) if cut.owners.count(owner) > 1]


def _read_cut(group: h5py.Group, structure: ElasticStructure, bodies: tuple[str, ...]) -> CutStructure:
    cut = structure.cut
    assert cut is not None
    sizes, pieces = np.diff(cut.structure.system.offsets), _pieces(cut)
    if not len(sizes) == len(cut.owners) == len(cut.names) == len(cut.inputs):
        raise KeyError("'structure/json' has a cut structure whose bodies do not fit")
    if not set(cut.owners) <= set(range(len(bodies))):
        raise KeyError("'structure/json' has a cut structure of other bodies")
    if any(len(at) != n for at, n in zip(cut.inputs, sizes, strict=True)):
        raise KeyError("'structure/json' has a cut structure whose inputs do not fit")
    read = iter(_flexibilities(group, "pieces", tuple(cut.names[i] for i in pieces), sizes[pieces]))
    own = [next(read) if i in pieces else structure.bodies[owner] for i, owner in enumerate(cut.owners)]
    return replace(cut, structure=replace(cut.structure, bodies=tuple(own)))


def _flexibilities(
    group: h5py.Group, kind: str, names: tuple[str, ...], sizes: np.ndarray
) -> tuple[PortFlexibility, ...]:
    found = []
    for name, n in zip(names, sizes, strict=True):
        where = f"structure/{kind}/{name}"
        own = member(group, f"{kind}/{name}", "structure")
        found.append(PortFlexibility(name, floats(own, "F", where), floats(own, "R", where)))
        if found[-1].F.shape != (n, n) or found[-1].R.shape != (n, 6):
            raise KeyError(f"'{where}' has matrices that do not fit")
    return tuple(found)


def _plain(value: Any) -> Any:
    """JSON values of dataclasses, arrays, tuples and numbers."""
    if isinstance(value, np.ndarray):
        return {"shape": list(value.shape), "values": value.ravel().tolist()}
    if is_dataclass(value):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    return [_plain(v) for v in value] if isinstance(value, tuple) else value
