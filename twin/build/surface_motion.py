"""How the surface of a body moves: by heat and by forces on its elastic ports, for pictures.

    u = D x + K_s^-1 U p + modes a        at the vertices of the surface, see `twin.build.flexibility`

Solved once per direction of the temperatures' basis and once per port. A body is factored anew for either and let go:
all factors at once would be the largest thing that a build keeps.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csc_array

from twin.build.cache import cached, machine_hash
from twin.build.elastic_ports import PortTable
from twin.build.elasticity import Elasticity, body_elasticity
from twin.build.flexibility import BLOCK, SupportedBody
from twin.build.full_model import FullModel
from twin.build.springs import spring_system
from twin.machine.bodies import bodies_of
from twin.machine.description import Machine


class SurfaceMotion:
    """The bodies of a full model with elastic ports."""

    def __init__(self, machine: Machine, full: FullModel):
        self._machine, self._full = machine, full

    def by_heat(self, body: int, V: np.ndarray) -> np.ndarray:
        """Displacements (3m, r) [m/K] of the surface of a supported body at temperatures V (n, r)."""
        nodal = V[: self._full.bodies[body].n]  # tanks come after the nodes
        return self._at_surface(body, V.shape[1], lambda elastic, block: elastic.KT @ nodal[:, block])

    def by_forces(self) -> tuple[np.ndarray, ...]:
        """The same per force on its ports (3m, p) [m/N], body by body."""
        ports = PortTable(self._full.bodies)
        spring_system(self._machine, bodies_of(self._machine), ports)  # the same ports as the structure's
        return tuple(self._by_forces(b, U.tocsc()) for b, U in enumerate(ports.matrices()))

    def _by_forces(self, body: int, U: csc_array) -> np.ndarray:
        return self._at_surface(body, U.shape[1], lambda _, block: U[:, block].toarray())

    def _at_surface(self, body: int, count: int, loads: Callable[[Elasticity, slice], np.ndarray]) -> np.ndarray:
        """(3m, count) of loads (3n, count), which are asked for in blocks."""
        mesh, selection = self._full.bodies[body], self._full.thermal.bodies[body].F
        assert selection is not None
        elastic = body_elasticity(self._machine, mesh)
        solid = SupportedBody(elastic, mesh.nodes)
        rows = (3 * selection.tocsr().indices[:, None] + np.arange(3)).ravel()
        found = np.zeros((len(rows), count))
        for start in range(0, count, BLOCK):
            block = slice(start, start + BLOCK)
            found[:, block] = solid.solve(loads(elastic, block))[rows]
        return found


def surface_flexibility(machine: Machine, full: FullModel) -> tuple[np.ndarray, ...]:
    """(3m, p) [m/N] per body: displacements of the surface of the supported body per force on its ports. Cached."""
    return cached("surface", __name__, (machine_hash(machine),), lambda: SurfaceMotion(machine, full).by_forces())
