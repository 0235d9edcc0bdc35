"""Axis offsets that cancel a TCP error, and what they cannot cancel (paper 001, 1.09 and E-001-5).

J maps axis motions to the motion of the tool as seen from the work: its column is the axis' direction where the axis
carries the tool, the opposite where it carries the work. The offset is -J^-1 w; with some axes only, the one that
leaves least, -J^+ w. Linear axes turn nothing, so a tilt of the tool against the work always stays.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from twin.errors import ModelError
from twin.rom.artefact import Artefact
from twin.rom.lumped_structure import LumpedStructure

PARALLEL = 1e-9  # singular values of J below this share of the largest are none


def axis_jacobian(artefact: Artefact, axes: Sequence[str]) -> np.ndarray:
    """J (3, n_axes): motion of the tool minus that of the work per motion of a linear axis, machine coordinates.

    It follows the kinematic chain of the description in the artefact. Of struts that carry a platform it is the unit
    matrix: their errors are told in their own lengths (`run.correction_struts`). Raises ModelError for an axis that
    moves neither the tool nor the work side, an unknown one, and for none at all.
    """
    if not axes:
        raise ModelError("the machine has no axis to correct with", "axes", "describe a linear axis with `poses`")
    structure = artefact.model.structure
    if isinstance(structure, LumpedStructure) and structure.platform is not None:
        return np.eye(len(axes))
    directions = {a.name: np.array(a.direction) for a in artefact.model.load_model.axes}
    machine = tomllib.loads(artefact.description)
    columns = []
    for axis in axes:
        sign = _tool_sign(machine, axis) if axis in directions and axis in machine.get("axes", {}) else 0
        if not sign:
            raise ModelError(
                f"axis '{axis}' moves neither the tool nor the work side",
                "axes of the poses",
                "see `axes`, `contacts` and `tcp` of machine.toml",
            )
        columns.append(sign * directions[axis])
    return np.array(columns).reshape(len(axes), 3).T


def offset_matrix(jacobian: np.ndarray, lever: float = 1.0) -> np.ndarray:
    """-J^+ (n_axes, c): offset = offset_matrix(J) @ error. Jacobian (c, n_axes), c = 3, or 6 with rotations below.

    lever [m] weighs rotations [rad] against displacements where rotary axes offer a choice: a tilt counts as what it
    does at this distance. Raises ModelError where two axes do the same.
    """
    scale = np.ones(len(jacobian))
    scale[3:] = lever
    weighted = scale[:, None] * jacobian
    size = np.linalg.svd(weighted, compute_uv=False)
    if len(size) < jacobian.shape[1] or size[-1] <= PARALLEL * size[0]:
        raise ModelError("two axes move the tool in the same way", "axes", "correct with one of them")
    return -np.linalg.pinv(weighted) * scale


def uncorrectable(jacobian: np.ndarray, error: np.ndarray, lever: float = 1.0) -> np.ndarray:
    """What stays of errors (m, c) when the axes have moved by `offset_matrix`: w + J offset, unit of each component."""
    return error + error @ (jacobian @ offset_matrix(jacobian, lever)).T


def _tool_sign(machine: dict[str, Any], axis: str) -> int:
    """1 where the axis moves the tool side, -1 where it moves the work side, 0 for neither or both."""
    bodies = _bodies(machine)
    moved = _moved(machine, bodies, axis)
    tcp = machine.get("tcp", {})
    if "tool" in tcp and "work" in tcp:
        tool, work = (bodies[_owner(tcp[side]["surface"])] in moved for side in ("tool", "work"))
        return int(tool) - int(work)
    for screw, side in tcp.get("screws", {}).items():  # a lumped machine: the screw's nut holds this side
        for name, rail, pad in _pairs(machine):
            if name == axis and _owner(rail) == screw:
                sign = 1 if side == "tool" else -1
                return sign * (int(bodies[_owner(pad)] in moved) - int(bodies[screw] in moved))
    return 0


def _owner(place: str) -> str:
    return place.partition(".")[0]


def _pairs(machine: dict[str, Any]) -> Iterator[tuple[str, str, str]]:
    for contact in machine.get("contacts", {}).values():
        if contact["kind"] == "moving":
            for rail, pad in contact["pairs"]:
                yield contact["axis"], rail, pad


def _bodies(machine: dict[str, Any]) -> dict[str, str]:
    """Body, named by any of its members, of every part, node and bar: fixed contacts join them."""
    body = {member: member for section in ("parts", "nodes", "bars") for member in machine.get(section, {})}
    for contact in machine.get("contacts", {}).values():
        if contact["kind"] == "fixed":
            a, b = (body[_owner(s)] for s in contact["surfaces"])
            body = {member: b if name == a else name for member, name in body.items()}
    return body


def _moved(machine: dict[str, Any], bodies: dict[str, str], axis: str) -> set[str]:
    """Bodies that the axis moves: those it carries, and all reached from there through contacts of other axes."""
    moved = {bodies[part] for part in machine["axes"][axis]["carries"]}
    joined = [(bodies[_owner(r)], bodies[_owner(p)]) for name, r, p in _pairs(machine) if name != axis]
    while True:
        reached = {b for pair in joined if moved & set(pair) for b in pair}
        if reached <= moved:
            return moved
        moved |= reached
