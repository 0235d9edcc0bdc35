"""Heat capacities behind a conductance on a part's surface: `[tanks.NAME]`, one more state of the body each.

    C x' = k (T_mean - x),      T_mean the mean temperature of the surface

The conductance is spread evenly over the surface: a point of it gives k/A (T - x) to the tank, whose sum is the right
side above. So what a tank adds to the conduction is symmetric, positive semidefinite, zero for equal temperatures and
as sparse as a film. One row of the mean against all others was rejected: it fills a block of the whole surface.

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
    A0, across, own = body.A0, [], []
    for tank in tanks.values():
        K = _exchange(mesh, tank)
        A0 = A0 + K
        across.append(-(K @ np.ones(mesh.n)))
        own.append(-across[-1].sum())  # the conductance, so that rows sum to zero
    beside = sp.csr_array(np.column_stack(across))
    A0 = sp.block_array([[A0, beside], [beside.T, sp.diags_array(np.array(own))]], format="csr")
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


def _exchange(mesh: BodyMesh, tank: Tank) -> sp.csr_array:
    """W/K (n, n) of the tank's conductance over its surface's nodes; its sum is the conductance."""
    name, surface = split_surface(tank.surface)
    part, offset = mesh.part(name)
    per_area = mass(part, part.facets(surface)).tocoo()
    values = per_area.data * (tank.conductance / per_area.data.sum())
    places = (per_area.coords[0] + offset, per_area.coords[1] + offset)
    return sp.csr_array(sp.coo_array((values, places), shape=(mesh.n, mesh.n)))
