"""The springs between bodies and to the ground, and the TCP, as a description gives them (`twin.rom.springs`)."""

from __future__ import annotations

import numpy as np

from twin.build.elastic_ports import PortTable
from twin.build.encoder import linear_encoders
from twin.build.scales import added_scale
from twin.errors import DescriptionError
from twin.machine.bodies import Body
from twin.machine.description import Contact, Machine, StiffnessOfPair
from twin.machine.kinematics import direction, displacement, linear_axes
from twin.machine.turning import turning_axes
from twin.rom.springs import Ground, Guide, SpringSystem
from twin.rom.turning import Turn

PLANE = 0.5  # a mean normal shorter than this is no plane's but a cylinder's


def spring_system(machine: Machine, bodies: tuple[Body, ...], ports: PortTable) -> SpringSystem:
    """Collect the springs and the TCP of a machine; adds the ports they need to `ports`.

    Raises DescriptionError: a pad whose normal is along the axis, radial stiffnesses of a cylinder that differ,
    a tool without a point; a scale that does not reach (`linear_encoders`).
    """
    names: list[str] = []
    stiffness: list[float] = []
    guides, grounds = [], []
    for name, contact in machine.contacts.items():
        if contact.kind != "moving":
            continue
        for i, pair in enumerate(contact.pairs):
            where = f"contacts.{name}.pairs[{i}]"
            guide, labels, values = _guide(machine, contact, pair, ports, len(names), where)
            guides.append(guide)
            names += [f"{where}.{label}" for label in labels]
            stiffness += values
    for name, support in machine.supports.items():
        stiff = [a for a in range(3) if support.stiffness[a] > 0]
        grounds.append(Ground(ports.mean(support.surface), np.eye(3)[stiff], len(names)))
        names += [f"supports.{name}.{'xyz'[a]}" for a in stiff]
        stiffness += [support.stiffness[a] for a in stiff]
    if machine.tcp.tool.point is None:
        remedy = "give the tool centre point at axis positions zero"
        raise DescriptionError("the tool has no point", "tcp.tool.point", remedy)
    tool, work = ports.rigid(machine.tcp.tool.surface), ports.rigid(machine.tcp.work.surface)
    axes = linear_axes(machine)
    shifts = np.array([[displacement(machine, b.name, {a: 1.0}) for a in axes] for b in bodies])
    shifts = shifts.reshape(len(bodies), len(axes), 3)
    encoders = linear_encoders(machine, ports, shifts)
    scales = [added_scale(machine, scale, *ports.surface_mean(scale.surface)) for scale in machine.scales.values()]
    turns = tuple(
        Turn(t.axis, direction(machine, t.axis), np.array(machine.axes[t.axis].point, dtype=float),
             ports.seat(t.surfaces, f"axes.{t.axis}"), t.sign) for t in turning_axes(machine)
    )  # fmt: skip
    return SpringSystem(
        axes=axes,
        shifts=shifts,
        offsets=np.cumsum([0] + [len(n) for n in ports.names]),
        names=tuple(names),
        stiffness=np.array(stiffness),
        guides=tuple(guides),
        grounds=tuple(grounds),
        tool=tool,
        tool_point=np.array(machine.tcp.tool.point),
        work=work,
        encoders=encoders,
        scales=tuple(scales),
        turns=turns,
    )


def _guide(
    machine: Machine, contact: Contact, pair: tuple[str, str], ports: PortTable, first: int, where: str
) -> tuple[Guide, list[str], list[float]]:
    assert contact.axis is not None, "the description was not checked"
    along = direction(machine, contact.axis)
    rail, pad = ports.rail(pair[0], along, contact.segments), ports.rigid(pair[1])
    vectors = _directions(along, pad.normal, contact.stiffness, where)
    stiff = [(label, getattr(contact.stiffness, label)) for label in vectors if getattr(contact.stiffness, label) > 0]
    directions = np.array([vectors[label] for label, _ in stiff]).reshape(len(stiff), 3)
    return Guide(rail, pad, along, directions, first), [s[0] for s in stiff], [s[1] for s in stiff]


def _directions(along: np.ndarray, normal: np.ndarray, k: StiffnessOfPair, where: str) -> dict[str, np.ndarray]:
    """Unit vectors axial, normal and lateral of a pair. A nut around its screw has no normal: any will do."""
    across = normal - (normal @ along) * along
    if float(np.linalg.norm(across)) < PLANE:
        if float(np.linalg.norm(normal)) > PLANE and (k.normal > 0 or k.lateral > 0):
            remedy = "name the face that slides, or correct the axis direction"
            raise DescriptionError("the pad's normal points along the axis", where, remedy)
        if k.normal != k.lateral:
            raise DescriptionError(
                "the pad has no normal (a cylinder?), but its normal and lateral stiffness differ",
                where,
                "give both the same, radial stiffness, or zero",
            )
        across = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    across = across / np.linalg.norm(across)
    return {"axial": along, "normal": across, "lateral": np.cross(across, along)}
