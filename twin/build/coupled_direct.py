"""The reference for `structure`: the whole coupled machine at one pose as one sparse system, factored directly.

Every body's stiffness and every spring in one matrix; no supports at nodes, no rigid-body modes, no condensation.
Costs a factorisation of the whole machine per pose: for tests, benchmarks and doubt.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import block_diag, csr_array, diags_array

from twin.build.elastic_ports import PortTable
from twin.build.elasticity import Elasticity, body_elasticity
from twin.build.factorize import factorize
from twin.build.mesh import BodyMesh
from twin.build.springs import spring_system
from twin.machine.bodies import bodies_of
from twin.machine.description import Machine
from twin.rom.springs import Positions, SpringSystem


@dataclass(frozen=True)
class CoupledMachine:
    """All bodies one after the other; N nodes, P ports."""

    K: csr_array  # (3N, 3N) N/m without springs
    KT: csr_array  # (3N, N) N/K
    U: csr_array  # (3N, P) port functionals
    system: SpringSystem
    first_nodes: np.ndarray  # (n_bodies + 1,) first node of each body

    def stiffness(self, positions: Positions) -> csr_array:
        """(3N, 3N) N/m of the coupled, supported machine at a pose."""
        L = self.U @ csr_array(self.system.gap_rows(positions).T)
        return csr_array(self.K + L @ diags_array(self.system.stiffness) @ L.T)

    def rows(self, positions: Positions) -> tuple[np.ndarray, ...]:
        """TCP rows (3, n_nodes_b) [m/K] per body, by one factorisation and three adjoint solves."""
        X = factorize(self.stiffness(positions), refine=2).solve(self.U @ self.system.tcp_rows(positions).T)
        rows = tuple(np.split((self.KT.T @ X).T, self.first_nodes[1:-1], axis=1))
        for b, nodes, growth in self.system.scale_rows(positions):
            rows[b][:, nodes] += growth
        return rows

    def field(self, positions: Positions, fields: Sequence[np.ndarray]) -> tuple[np.ndarray, ...]:
        """Displacements (n_nodes_b, 3) [m] per body of T - T_ref (n_nodes_b,) [K] per body, nuts as datum."""
        load = self.KT @ np.concatenate(fields)
        u = factorize(self.stiffness(positions), refine=2).solve(load[:, None])[:, 0]
        return tuple(np.split(u.reshape(-1, 3), self.first_nodes[1:-1]))

    def displacement(self, positions: Positions, fields: Sequence[np.ndarray]) -> np.ndarray:
        """TCP displacement (3,) [m]."""
        u = np.concatenate(self.field(positions, fields)).ravel()
        w = self.system.tcp_rows(positions) @ (self.U.T @ u)
        return w + sum(growth @ fields[b][nodes] for b, nodes, growth in self.system.scale_rows(positions))


def assemble_coupled(machine: Machine, bodies: tuple[BodyMesh, ...]) -> CoupledMachine:
    """Assemble the machine without condensing it. Raises DescriptionError like `assemble_structure`."""
    ports = PortTable(bodies)
    system = spring_system(machine, bodies_of(machine), ports)
    solids: list[Elasticity] = [body_elasticity(machine, body) for body in bodies]
    return CoupledMachine(
        K=csr_array(block_diag([s.K for s in solids], format="csr")),
        KT=csr_array(block_diag([s.KT for s in solids], format="csr")),
        U=csr_array(block_diag(ports.matrices(), format="csr")),
        system=system,
        first_nodes=np.cumsum([0] + [body.n for body in bodies]),
    )
