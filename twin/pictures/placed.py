"""The machine as it stands at given axis positions, and the poses of its grid as points in space."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from twin.machine.bodies import bodies_of, body_of, split_surface
from twin.machine.description import Machine
from twin.machine.kinematics import direction, displacement, rail_moves
from twin.machine.platform import geometry_of
from twin.pictures.surface import SurfaceMesh
from twin.rom.artefact import Artefact
from twin.rom.parallel import forward
from twin.rom.turned_surface import surface_turns, turned_surface


def described(artefact: Artefact) -> Machine:
    """The description that the artefact was built from."""
    return Machine.model_validate(tomllib.loads(artefact.description))


def no_tcp(artefact: Artefact) -> str:
    """What a description lacks where no temperature moves the tool."""
    keys = "[tcp.expansion] and no [tcp.screws]" if described(artefact).lumped else "[tcp.tool] and no [tcp.work]"
    return f"the description has no {keys}"


def placed_surface(
    machine: Machine,
    artefact: Artefact,
    positions: Mapping[str, float],
    angles: Sequence[float] = (),
) -> SurfaceMesh:
    """All bodies' surfaces with every linear axis at its position [m], and those that turn at their angles [rad], at
    zero where none are given; points in the order of the artefact's `fields`."""
    fields, turns = artefact.fields, surface_turns(artefact.model, artefact.fields)
    points = [
        turned_surface(turns, f, np.asarray(angles))[0] + displacement(machine, f.body, dict(positions)) for f in fields
    ]
    first = np.cumsum([0, *(len(p) for p in points)])
    triangles = np.vstack([f.triangles + n for f, n in zip(fields, first, strict=False)])
    return SurfaceMesh(np.vstack(points), triangles, parts_of(triangles, int(first[-1])))


def parts_of(triangles: np.ndarray, n_points: int) -> np.ndarray:
    """Connected piece (m,) of each triangle (m, 3): parts share no vertices, so this tells them apart."""
    links = coo_array(
        (
            np.ones(2 * len(triangles)),
            (np.r_[triangles[:, 0], triangles[:, 1]], np.r_[triangles[:, 1], triangles[:, 2]]),
        ),
        (n_points, n_points),
    )
    return connected_components(links, directed=False)[1][triangles[:, 0]]


def poses_in_space(machine: Machine, axes: Sequence[str], poses: np.ndarray) -> np.ndarray:
    """The tool's place as seen from the work (n_poses, 3) [m] at poses (n_poses, n_axes) [m]; zero at position zero."""
    if machine.tcp.platform is not None:
        return np.array([forward(geometry_of(machine), p).shift for p in poses])
    if machine.lumped:
        return poses @ np.array([_lumped_axis(machine, a) for a in axes]).reshape(len(axes), 3)
    bodies = bodies_of(machine)
    tool, work = (body_of(bodies, split_surface(side.surface)[0]).name for side in (machine.tcp.tool, machine.tcp.work))
    per_metre = np.array([displacement(machine, tool, {a: 1.0}) - displacement(machine, work, {a: 1.0}) for a in axes])
    return poses @ per_metre.reshape(len(axes), 3)


def _lumped_axis(machine: Machine, axis: str) -> np.ndarray:
    """How the tool moves (3,) with an axis, as seen from the work: screws tell which side moves, else the tool does."""
    along = direction(machine, axis)
    for contact in machine.contacts.values():
        for rail, pad in contact.pairs if contact.axis == axis else ():
            if (side := machine.tcp.screws.get(rail)) is not None:
                nut_moves = not rail_moves(machine, axis, rail, pad)
                return along if nut_moves == (side == "tool") else -along
    return along
