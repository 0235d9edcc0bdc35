"""Heat capacities behind a conductance on a part's surface: `[tanks.NAME]`, one more state of the body each.

    C x' = k (T_mean - x),      T_mean the mean temperature of the surface

What it takes leaves the surface evenly, as the heat of a source enters it. So what a tank adds to the conduction has
rank one, is symmetric, positive semidefinite and zero for equal temperatures: k [b, -1] [b, -1]^T with the weights b of
the mean. An exchange k/A (T - x) point by point, as sparse as a film, was rejected: through it the warm end of a face
heats the cold one, so that a tank is a short circuit before it stores anything, and `twin diagnose`, which looks for a
capacity with the mean's history, could not name what `twin hide` had hidden. The block of b b^T is dense: of a large
surface every second, third, ... node is taken.

The tanks follow the nodes of their body, each a member of its own, "tanks.NAME". They carry no film, source, port or
sensor, and do not grow.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from twin.build.mesh import BodyMesh
from twin.build.surface import mass
from twin.machine.bodies import split_surface, tanks_on
from twin.machine.description import Machine, Tank
from twin.rom.model import AffineBody

MOST = 3000  # nodes: their block has 9 million entries


def with_tanks(machine: Machine, mesh: BodyMesh, body: AffineBody) -> AffineBody:
    """A body of the full model with its tanks' states at the end; itself where there are none.

    Raises DescriptionError for surfaces that do not exist.
    """
    tanks = tanks_on(machine, tuple(part.name for part in mesh.parts))
    if not tanks:
        return body
    m = len(tanks)

    def wider(rows: np.ndarray) -> np.ndarray:
        return np.concatenate([rows, np.zeros((*rows.shape[:-1], m))], axis=-1)

    def longer(columns: np.ndarray) -> np.ndarray:
        return np.concatenate([columns, np.zeros((m, columns.shape[1]))])

    capacities = np.array([tank.capacity for tank in tanks.values()])
    nothing = sp.csr_array((m, m))
    means = sp.csr_array(np.column_stack([_mean(mesh, tank) for tank in tanks.values()]))
    k = sp.diags_array(np.array([tank.conductance for tank in tanks.values()]))
    A0 = sp.block_array([[body.A0 + means @ k @ means.T, -means @ k], [-k @ means.T, k]], format="csr")
    return replace(
        body,
        E=sp.csr_array(sp.block_diag([body.E, sp.diags_array(capacities)], format="csr")),
        A0=sp.csr_array(A0),
        A=tuple(sp.csr_array(sp.block_diag([a, nothing], format="csr")) for a in body.A),
        M=longer(body.M),
        B=longer(body.B),
        P=longer(body.P),
        C=wider(body.C),
        G=wider(body.G),
        one=np.append(body.one, np.ones(m)),
        energy=np.append(body.energy, capacities),
        H=None if body.H is None else longer(body.H),
        members=(*body.members, *tanks),
        first=(*body.first, *range(mesh.n, mesh.n + m)),
    )


def _mean(mesh: BodyMesh, tank: Tank) -> np.ndarray:
    """(n,) weights of the mean temperature of a tank's surface, of MOST of its nodes at most."""
    name, surface = split_surface(tank.surface)
    part, offset = mesh.part(name)
    area = np.asarray(mass(part, part.facets(surface)).sum(axis=1)).ravel()  # m^2 of each node; none of a flat corner's
    nodes = np.flatnonzero(np.abs(area) > 1e-9 * area.max())
    nodes = nodes[:: -(-len(nodes) // MOST)]
    weights = np.zeros(mesh.n)
    weights[nodes + offset] = area[nodes] / area[nodes].sum()
    return weights
