"""Offsets of linear and rotary axes together: what also takes up a tilt of the tool against the work.

The geometric Jacobian J (6, n) maps axis motions to the motion of the tool as seen from the work: displacement above,
rotation below. The column of a rotary axis that carries the work is -[d x (q - c); d], d its direction, c a point on
it and q the tool centre point, all in space at the pose; of one that carries the tool it is the opposite. Offsets are
-J^+ [w; tilt]. Tilt about other directions stays.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from twin.errors import ModelError
from twin.rom.artefact import Artefact
from twin.rom.elastic_structure import ElasticStructure
from twin.run.correction import PoseErrors
from twin.run.correction_axes import axis_jacobian, offset_matrix
from twin.run.correction_polynomial import Polynomial, fit_full, normalised_axes
from twin.units import to_si


@dataclass(frozen=True)
class RotaryAxis:
    """A rotary axis at axis positions zero."""

    name: str
    direction: np.ndarray  # (3,) unit vector
    point: np.ndarray  # (3,) m, on the axis
    body: int  # that it is part of
    sign: int  # 1: it carries the tool, -1: the work


@dataclass(frozen=True)
class RotaryCorrection:
    """Offsets of all axes as polynomials over the linear ones, and what they leave at the poses."""

    axes: tuple[str, ...]  # the linear ones, then the rotary ones
    polynomial: Polynomial  # offsets [m, rad] in the order of `axes`
    left: np.ndarray  # (3,) m, largest
    left_tilt: np.ndarray  # (3,) rad, largest


def rotary_axes(artefact: Artefact) -> tuple[RotaryAxis, ...]:
    """Those whose description says where they lie and that carry either the tool or the work.

    Raises ModelError where there is none.
    """
    machine = tomllib.loads(artefact.description)
    bodies = artefact.model.bodies
    structure = artefact.model.structure
    found = []
    if isinstance(structure, ElasticStructure):
        tool, work = structure.system.tool.body, structure.system.work.body
        for name, axis in machine.get("axes", {}).items():
            if axis.get("kind") != "rotary" or "point" not in axis:
                continue
            carrying = next((i for i, b in enumerate(bodies) if set(axis["carries"]) & {b.name, *b.members}), -1)
            sign = int(carrying == tool) - int(carrying == work)
            if sign:
                d = np.array(axis["direction"], dtype=float)
                point = np.array([to_si(p, "m") for p in axis["point"]])
                found.append(RotaryAxis(name, d / np.linalg.norm(d), point, carrying, sign))
    if not found:
        remedy = "write a point on each rotary axis, point = ['0 mm', '800 mm', '500 mm'] in [axes.NAME]"
        raise ModelError("no rotary axis of tool or work says where it lies", "axes", remedy)
    return tuple(found)


def geometric_jacobian(
    artefact: Artefact, linear: tuple[str, ...], rotary: tuple[RotaryAxis, ...], position: Mapping[str, float]
) -> np.ndarray:
    """J (6, n_linear + n_rotary) at positions [m] of linear axes and angles [rad] of those that turn, others at zero.

    Raises ModelError.
    """
    structure = artefact.model.structure
    assert isinstance(structure, ElasticStructure)
    system = structure.system
    shift = np.einsum("bak,a->bk", system.shifts, system.vector(position))
    tool_point = system.tool_centre(position)
    columns = [np.vstack([axis_jacobian(artefact, linear), np.zeros((3, len(linear)))])]
    for axis in rotary:
        point, direction = system.in_space(axis.name, axis.point, axis.direction, position)
        lever = tool_point - point - shift[axis.body]
        turned = np.concatenate([np.cross(direction, lever), direction])
        columns.append(axis.sign * turned[:, None])
    return np.hstack(columns)


def fit_rotary(artefact: Artefact, errors: PoseErrors, lever: float = 0.1) -> RotaryCorrection:
    """Offsets at the poses and their polynomials, parabolas over the workspace, less where there are fewer positions.

    lever [m] weighs a tilt left against a displacement left: as what it does at the end of a tool of this length.
    Raises ModelError where no rotary axis is described, or the model does not tell the tilt.
    """
    rotary = rotary_axes(artefact)
    tilt = errors.tilt
    if tilt is None:
        raise ModelError("the artefact does not tell the tilt of the tool", artefact.model.name, "build it again")
    offsets, rest = [], []
    for pose, error in zip(errors.poses, np.hstack([errors.tcp, tilt]), strict=True):
        where = dict(zip((*errors.axes, *artefact.model.turning), (*pose, *errors.angles), strict=False))
        J = geometric_jacobian(artefact, errors.axes, rotary, where)
        offsets.append(offset_matrix(J, lever) @ error)
        rest.append(error + J @ offsets[-1])
    degrees = [min(2, len(nodes) - 1) for nodes in errors.grid]
    polynomial = fit_full(normalised_axes(errors.axes, errors.poses, degrees), errors.poses, np.array(offsets))
    largest = np.abs(rest).max(axis=0)
    return RotaryCorrection((*errors.axes, *(a.name for a in rotary)), polynomial, largest[:3], largest[3:])
