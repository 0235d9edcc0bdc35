"""Can a body move freely? Asked of rigid bodies on the springs of contacts and supports: no matrix is factored.

The stiffness of a machine against rigid motions a of its bodies is R^T J^T k J R, with the gaps g = J w of the springs
k and the port displacements w = R a (`twin.rom.elastic_structure`, all flexibilities zero). Flexible bodies yield more,
but a motion that opens no gap is free in both.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from twin.build.elastic_ports import PortTable, rigid_modes
from twin.build.mesh import BodyMesh
from twin.build.springs import spring_system
from twin.errors import Problem, TwinError
from twin.machine.bodies import bodies_of, owner_of
from twin.machine.description import Machine
from twin.rom.elastic_structure import ElasticStructure, Mechanism, PortFlexibility

PLACES = 3  # of every axis: both ends of its stroke and its middle


def mechanisms(machine: Machine, bodies: tuple[BodyMesh, ...]) -> Iterator[Problem]:
    """A problem for the first position of the axes at which a body can move freely, as `assemble_structure` refuses it.

    bodies: the meshes in the order of `bodies_of`, of a description whose contacts and supports are sound. What
    `spring_system` refuses is a problem too.
    """
    try:
        structure = rigid_structure(machine, bodies)
    except TwinError as e:
        yield from e.problems
        return
    strokes = [np.linspace(*machine.axes[a].stroke, PLACES) for a in structure.axes]
    for position in product(*strokes):
        try:
            structure.refuse_mechanism(np.array(position))
        except Mechanism as e:
            yield _located(machine, e)
            return


def rigid_structure(machine: Machine, bodies: tuple[BodyMesh, ...]) -> ElasticStructure:
    """The machine of rigid bodies. Raises DescriptionError as `spring_system`."""
    ports = PortTable(bodies)
    system = spring_system(machine, bodies_of(machine), ports)
    rigid = [
        PortFlexibility(body.name, np.zeros((U.shape[1],) * 2), U.T @ rigid_modes(body.nodes))
        for body, U in zip(bodies, ports.matrices(), strict=True)
    ]
    middles = np.array([body.nodes.mean(axis=0) for body in bodies])
    size = max(float(np.linalg.norm(b.nodes - m, axis=1).max()) for b, m in zip(bodies, middles, strict=True))
    return ElasticStructure(tuple(rigid), system, middles, size)


def _located(machine: Machine, found: Mechanism) -> Problem:
    """The refusal with the keys that could hold what moves: its supports, or what joins it to the rest."""
    (problem,) = found.problems
    moving = {part for body in bodies_of(machine) if body.name in found.bodies for part in body.parts}
    supports = [f"supports.{n}.stiffness" for n, s in machine.supports.items() if owner_of(s.surface) in moving]
    joining = sorted(
        (c.stiffness.axial + c.stiffness.normal + c.stiffness.lateral, f"contacts.{name}.stiffness")
        for name, c in machine.contacts.items()
        if any((owner_of(rail) in moving) != (owner_of(pad) in moving) for rail, pad in c.pairs)
    )
    keys = [*supports, *(key for _, key in joining)]  # of contacts the softest first
    remedy = problem.remedy + (f": here {', '.join(keys)}" if keys else "")
    return Problem(f"{problem.where}: {problem.what}", f"machine.toml: {keys[0] if keys else 'supports'}", remedy)
