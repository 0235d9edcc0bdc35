"""How the surface of a body moves: by heat and by forces on its elastic ports, for pictures.

    u = D x + K_s^-1 U p + modes a        at the vertices of the surface, see `twin.build.flexibility`

Solved once per state of the compact model and once per port, with one factor of each body, which is let go before the
next: all factors at once would be the largest thing that a build keeps. Kept in single precision, so that iterative
refinement of the solutions would be for nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.sparse import csc_array

from twin.build.cache import arrays_hash, cached, machine_hash
from twin.build.elastic_ports import PortTable
from twin.build.elasticity import body_elasticity
from twin.build.flexibility import BLOCK, SupportedBody
from twin.build.full_model import FullModel
from twin.build.springs import spring_system
from twin.machine.bodies import bodies_of
from twin.machine.description import Machine


def surface_motion(
    machine: Machine, full: FullModel, bases: Sequence[np.ndarray]
) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """Per body the displacements of the vertices of its surface, on isostatic supports; cached.

    By heat (3m, r) [m/K], at the temperatures of its basis (n, r), and per force on its ports (3m, p) [m/N].
    """

    def make() -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        ports = PortTable(full.bodies)
        spring_system(machine, bodies_of(machine), ports)  # the same ports as the structure's
        per_body = enumerate(zip(bases, ports.matrices(), strict=True))
        return tuple(_of_body(machine, full, b, V, U.tocsc()) for b, (V, U) in per_body)

    return cached("surface", __name__, (machine_hash(machine), arrays_hash(bases)), make)


def _of_body(
    machine: Machine, full: FullModel, body: int, V: np.ndarray, U: csc_array
) -> tuple[np.ndarray, np.ndarray]:
    mesh, selection = full.bodies[body], full.thermal.bodies[body].F
    assert selection is not None
    elastic = body_elasticity(machine, mesh)
    solid = SupportedBody(elastic, mesh.nodes, refine=0)
    rows = (3 * selection.tocsr().indices[:, None] + np.arange(3)).ravel()

    def at_surface(count: int, loads: Callable[[slice], np.ndarray]) -> np.ndarray:
        """(3m, count) of loads (3n, count), which are asked for in blocks."""
        found = np.zeros((len(rows), count))
        for start in range(0, count, BLOCK):
            block = slice(start, start + BLOCK)
            found[:, block] = solid.solve(loads(block))[rows]
        return found

    nodal = V[: mesh.n]  # tanks come after the nodes
    by_heat = at_surface(V.shape[1], lambda block: elastic.KT @ nodal[:, block])
    return by_heat, at_surface(U.shape[1], lambda block: U[:, block].toarray())
