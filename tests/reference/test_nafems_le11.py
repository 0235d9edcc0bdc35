"""NAFEMS LE11: solid cylinder, taper and sphere under a temperature field; sigma_zz at A is -105 MPa.

National Agency for Finite Element Methods and Standards, The Standard NAFEMS Benchmarks, TNSB Rev. 3, 1990, test LE11.
A quarter of the body of revolution, as a mapped structured mesh of quadratic (curved) tetrahedra.
"""

from __future__ import annotations

import numpy as np
import pytest
from skfem import MeshTet1, MeshTet2

from twin.build.elasticity import solid_elasticity, stress
from twin.build.factorize import factorize
from twin.machine.description import Material

STEEL = Material(
    conductivity=1.0, density=1.0, heat_capacity=1.0, youngs_modulus=210e9, poisson_ratio=0.3, expansion=2.3e-4
)
CORNER = np.sqrt(0.5)
TOP = 1.797


def section(s: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(r, z) of s in [0, 1] from the inner to the outer line and t in [0, 3]: sphere, taper, cylinder."""
    angle = np.clip(t, 0, 1)
    inner, outer = angle * np.pi / 4, angle * np.arcsin(CORNER / 1.4)
    up, top = np.clip(t - 1, 0, 1), np.clip(t - 2, 0, 1)
    inner_r, inner_z = np.cos(inner), np.sin(inner) + up * (1.397 - CORNER) + top * (TOP - 1.397)
    outer_r = 1.4 * np.cos(outer) - up * (1.4 * np.cos(np.arcsin(CORNER / 1.4)) - 1.0)
    outer_z = 1.4 * np.sin(outer) + up * (1.397 - CORNER) + top * (TOP - 1.397)
    return (1 - s) * inner_r + s * outer_r, (1 - s) * inner_z + s * outer_z


def le11_mesh() -> tuple[MeshTet2, np.ndarray]:
    """The curved mesh and its nodes' parameters (3, n): s, t, angle. Finest (0.05) at A: s = 0, t = 0."""
    s = np.array([0.0, 0.08, 0.2, 0.4, 0.7, 1.0])
    t = np.concatenate([[0.0, 0.04, 0.1, 0.2, 0.35, 0.55, 0.75], [1.0, 1.5, 2.0, 2.5, 3.0]])
    angle = np.linspace(0, np.pi / 2, 13)
    flat = MeshTet2.from_mesh(MeshTet1.init_tensor(s, t, angle))
    s, t, angle = flat.doflocs
    r, z = section(s, t)
    return MeshTet2(np.array([r * np.cos(angle), r * np.sin(angle), z]), flat.t), flat.doflocs


def test_le11_stress_within_one_percent() -> None:
    mesh, (s, t, angle) = le11_mesh()
    x, y, z = mesh.doflocs
    T = np.hypot(x, y) + z
    solid = solid_elasticity(mesh, STEEL)
    node = np.arange(len(s))
    fixed = np.concatenate(
        [
            3 * node[np.isclose(angle, np.pi / 2)],
            3 * node[angle == 0] + 1,
            3 * node[(t == 0) | (t == 3)] + 2,
        ]
    )
    free = np.setdiff1d(np.arange(3 * len(s)), fixed)
    u = np.zeros(3 * len(s))
    u[free] = factorize(solid.K[free][:, free]).solve((solid.KT @ T)[free])
    sigma, corners = stress(mesh, STEEL, u, T)
    at_A = (s[corners] == 0) & (t[corners] == 0)
    assert at_A.sum() > 20
    assert sigma[at_A][:, 2, 2].mean() == pytest.approx(-105e6, rel=0.01)
