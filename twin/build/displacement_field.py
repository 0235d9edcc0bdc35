"""Displacements of every node at a pose: for pictures, and for what the TCP rows leave out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.build.elastic_ports import PortTable, rigid_modes
from twin.build.elasticity import Elasticity, body_elasticity
from twin.build.flexibility import SupportedBody
from twin.build.mesh import BodyMesh
from twin.build.springs import spring_system
from twin.build.structure import Structure
from twin.machine.bodies import bodies_of
from twin.machine.description import Machine
from twin.rom.springs import Positions


class DisplacementField:
    """Recovers u of all nodes from the condensed structure; keeps the factors of all bodies in memory."""

    def __init__(self, machine: Machine, bodies: tuple[BodyMesh, ...], structure: Structure):
        self._structure = structure
        self._bodies = bodies
        self._elasticity: list[Elasticity] = [body_elasticity(machine, body) for body in bodies]
        self._supported = [SupportedBody(e, b.nodes) for e, b in zip(self._elasticity, bodies, strict=True)]
        ports = PortTable(bodies)
        spring_system(machine, bodies_of(machine), ports)  # the same ports as the structure's, in the same order
        self._U = ports.matrices()

    def __call__(self, positions: Positions, fields: Sequence[np.ndarray]) -> tuple[np.ndarray, ...]:
        """Displacements (n_nodes_b, 3) [m] per body; fields: T - T_ref (n_nodes_b,) [K] per body.

        One back substitution per body. Raises ModelError where a body moves freely.
        """
        forces, motions = self._structure.solve(positions, fields)
        system = self._structure.system
        loads = np.split(-system.gap_rows(positions).T @ forces, system.offsets[1:-1])
        shifts = self._structure.encoder_shifts(positions, fields)
        nodal = [T[: body.n] for T, body in zip(fields, self._bodies, strict=True)]  # tanks come after the nodes
        return tuple(
            (supported.solve((e.KT @ T + U @ p)[:, None])[:, 0] + rigid_modes(body.nodes) @ a).reshape(-1, 3) + shift
            for supported, e, U, T, p, body, a, shift in zip(
                self._supported, self._elasticity, self._U, nodal, loads, self._bodies, motions, shifts, strict=True
            )
        )
