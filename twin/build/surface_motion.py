"""How the surface of a body moves: by heat and by forces on its elastic ports, for pictures.

    u = D x + K_s^-1 U p + modes a        at the vertices of the surface, see `twin.build.flexibility`

Solved once per direction of the temperatures' basis and once per port, with a factor of its own.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from twin.build.cache import cached, machine_hash
from twin.build.elastic_ports import PortTable
from twin.build.elasticity import Elasticity, body_elasticity
from twin.build.flexibility import BLOCK, SupportedBody
from twin.build.full_model import FullModel
from twin.build.springs import spring_system
from twin.machine.bodies import bodies_of
from twin.machine.description import Machine


class SurfaceMotion:
    """The bodies of a full model with elastic ports; each is factored when it is first asked for."""

    def __init__(self, machine: Machine, full: FullModel):
        self._machine, self._full = machine, full
        self._solid = cache(self._factored)

    def by_heat(self, body: int, V: np.ndarray) -> np.ndarray:
        """Displacements (3m, r) [m/K] of the surface of a supported body at temperatures V (n, r)."""
        solid, elastic = self._solid(body)
        loads = elastic.KT @ V[: self._full.bodies[body].n]  # tanks come after the nodes
        return self._at_surface(body, solid, loads)

    def by_forces(self) -> tuple[np.ndarray, ...]:
        """The same per force on its ports (3m, p) [m/N], body by body."""
        ports = PortTable(self._full.bodies)
        spring_system(self._machine, bodies_of(self._machine), ports)  # the same ports as the structure's
        return tuple(self._at_surface(b, self._solid(b)[0], U.toarray()) for b, U in enumerate(ports.matrices()))

    def _factored(self, body: int) -> tuple[SupportedBody, Elasticity]:
        mesh = self._full.bodies[body]
        elastic = body_elasticity(self._machine, mesh)
        return SupportedBody(elastic, mesh.nodes), elastic

    def _at_surface(self, body: int, solid: SupportedBody, loads: np.ndarray) -> np.ndarray:
        selection = self._full.thermal.bodies[body].F
        assert selection is not None
        vertices = selection.tocsr().indices
        rows = (3 * vertices[:, None] + np.arange(3)).ravel()
        blocks = np.split(loads, range(BLOCK, loads.shape[1], BLOCK), axis=1)
        return np.hstack([solid.solve(block)[rows] for block in blocks])


def surface_flexibility(machine: Machine, full: FullModel) -> tuple[np.ndarray, ...]:
    """(3m, p) [m/N] per body: displacements of the surface of the supported body per force on its ports. Cached."""
    return cached("surface", __name__, (machine_hash(machine),), lambda: SurfaceMotion(machine, full).by_forces())
