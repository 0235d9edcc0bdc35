"""The structure with its bodies cut at the bearings of rotary axes: `twin.rom.elastic_structure.CutStructure`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array

from twin.build.bearing import Side, bearing_sides
from twin.build.elastic_ports import PortTable
from twin.build.flexibility import BodyFlexibility
from twin.build.mesh import BodyMesh, body_mesh
from twin.build.springs import spring_system
from twin.errors import DescriptionError
from twin.machine.bodies import Body, bodies_of
from twin.machine.description import Machine
from twin.machine.turning import Turning, pieces_of, turning_axes
from twin.rom.elastic_structure import CutStructure, ElasticStructure
from twin.rom.springs import SpringSystem
from twin.rom.turning import HELD, Bearing, FittedPort

Condense = Callable[[Machine, BodyMesh, list[str], csr_array], BodyFlexibility]


def cut_structure(
    machine: Machine, bodies: tuple[BodyMesh, ...], whole: tuple[BodyFlexibility, ...], condense: Condense
) -> CutStructure | None:
    """None where no rotary axis turns anything. `inputs` are empty until `elastic_inputs` fills them.

    bodies: the meshes in the order of `bodies_of`; whole: these, condensed; bodies that are not cut stay what they are.
    Raises DescriptionError for bearings without area or between other parts than what turns and what it turns on.
    """
    turning = turning_axes(machine)
    if not turning:
        return None
    parts = [pieces_of(body, turning) for body in bodies_of(machine)]
    owners = tuple(i for i, own in enumerate(parts) for _ in own)
    pieces = tuple(piece for own in parts for piece in own)
    meshes = tuple(_mesh(piece, bodies[i]) for piece, i in zip(pieces, owners, strict=True))
    ports = PortTable(meshes)
    system = _held(machine, turning, bodies, pieces, meshes, ports)
    loose = {c for t in turning for c in t.bearing}
    apart = machine.model_copy(update={"contacts": {n: c for n, c in machine.contacts.items() if n not in loose}})

    def flexible(i: int, mesh: BodyMesh, names: list[str], U: csr_array) -> BodyFlexibility:
        if owners.count(i) == 1:
            return whole[i]
        own = condense(apart, mesh, names, U)
        columns = np.concatenate([bodies[i].part(p.name)[1] + np.arange(p.n) for p in mesh.parts])
        H = np.zeros((len(own.H), whole[i].H.shape[1]))
        H[:, columns] = own.H
        return replace(own, H=H)

    each = tuple(map(flexible, owners, meshes, ports.names, ports.matrices()))
    middles = np.array([mesh.nodes.mean(axis=0) for mesh in meshes])
    size = max(float(np.linalg.norm(b.nodes - m, axis=1).max()) for b, m in zip(meshes, middles, strict=True))
    structure = ElasticStructure(each, system, middles, size)
    return CutStructure(structure, tuple(mesh.name for mesh in meshes), owners, ())


def _held(
    machine: Machine, turning: tuple[Turning, ...], bodies: tuple[BodyMesh, ...], pieces: tuple[Body, ...],
    meshes: tuple[BodyMesh, ...], ports: PortTable,
) -> SpringSystem:  # fmt: skip
    """The springs of the machine and those that hold pieces together at bearings."""
    system = spring_system(machine, pieces, ports)
    names, bearings = list(system.names), []
    for k, t in enumerate(turning):
        bearings.append(_bearing(machine, t, k, bodies, pieces, meshes, ports, len(names)))
        names += [f"axes.{t.axis}.bearing[{i}]" for i in range(3 * len(bearings[-1].harmonics))]
    return replace(
        system,
        offsets=np.cumsum([0] + [len(n) for n in ports.names]),
        names=tuple(names),
        stiffness=np.concatenate([system.stiffness, np.full(len(names) - len(system.names), HELD)]),
        bearings=tuple(bearings),
    )


def _mesh(piece: Body, whole: BodyMesh) -> BodyMesh:
    return whole if len(piece.parts) == len(whole.parts) else body_mesh(
        piece.name, tuple(whole.part(name)[0] for name in piece.parts)
    )  # fmt: skip


def _bearing(
    machine: Machine, t: Turning, k: int, bodies: tuple[BodyMesh, ...], pieces: tuple[Body, ...],
    meshes: tuple[BodyMesh, ...], ports: PortTable, first: int,
) -> Bearing:  # fmt: skip
    axis = machine.axes[t.axis]
    d, point = np.array(axis.direction, dtype=float), np.array(axis.point, dtype=float)
    body = next(b for b in bodies if b.name == t.body)
    harmonics, inner, outer = bearing_sides(body, t.surfaces, point, d / np.linalg.norm(d), f"axes.{t.axis}")
    held = [_port(f"axes.{t.axis}.{n}", s, pieces, meshes, ports) for n, s in (("inner", inner), ("outer", outer))]
    return Bearing(k, held[0], held[1], harmonics, first)


def _port(
    name: str, sides: list[Side], pieces: tuple[Body, ...], meshes: tuple[BodyMesh, ...], ports: PortTable
) -> FittedPort:
    """Of all contacts of a bearing together."""
    owner = {next(i for i, piece in enumerate(pieces) if side.part in piece.parts) for side in sides}
    if len(owner) > 1:
        what = "parts that turn about different axes hold it"
        raise DescriptionError(what, name, "join what turns to one part, and that to one that it turns on")
    (body,) = owner
    nodes = np.concatenate([side.nodes + meshes[body].part(side.part)[1] for side in sides])
    values = np.hstack([side.values for side in sides])
    return ports.fitted(name, body, nodes, values)
