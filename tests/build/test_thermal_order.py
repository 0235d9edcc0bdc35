"""Manufactured solution: the temperature converges with order 3 in L2 (quadratic tetrahedra)."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from skfem import Functional, LinearForm

from tests.build.parts import STEEL, box
from twin.build.factorize import factorize
from twin.build.mesh import PartMesh
from twin.build.surface import mass
from twin.build.thermal import part_matrices

FILM = 200.0  # W/(m^2 K)


def exact(x: np.ndarray) -> np.ndarray:
    return np.sin(2.0 * x[0]) * np.cos(1.5 * x[1]) * np.exp(x[2])


def source(x: np.ndarray) -> np.ndarray:
    """-lambda Laplace T."""
    return STEEL.conductivity * (4.0 + 2.25 - 1.0) * exact(x)


def solve(part: PartMesh) -> np.ndarray:
    """T of -lambda Laplace T = f with a film on all sides, whose ambient follows from T itself."""
    _, A0 = part_matrices(part, STEEL)
    outer = part.mesh.boundary_facets()
    K = sp.csr_array(A0 + FILM * mass(part, outer))
    load = LinearForm(lambda v, w: source(w.x) * v).assemble(part.basis)
    boundary = part.basis.boundary(outer)

    def flux(w):  # lambda dT/dn + h T on the surface
        x, y, z = w.x
        gradient = np.stack(
            [
                2.0 * np.cos(2.0 * x) * np.cos(1.5 * y) * np.exp(z),
                -1.5 * np.sin(2.0 * x) * np.sin(1.5 * y) * np.exp(z),
                exact(w.x),
            ]
        )
        return STEEL.conductivity * (gradient * w.n).sum(axis=0) + FILM * exact(w.x)

    load = load + LinearForm(lambda v, w: flux(w) * v).assemble(boundary)
    return factorize(K).solve(load)


def l2_error(part: PartMesh, T: np.ndarray) -> float:
    squared = Functional(lambda w: (w["T"] - exact(w.x)) ** 2)
    return float(np.sqrt(squared.assemble(part.basis, T=part.basis.interpolate(T))))


def test_the_temperature_converges_with_order_three():
    errors = []
    for n in (4, 8, 12):
        part = box("a", (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (n, n, n))
        errors.append(l2_error(part, solve(part)))
    order = np.log(errors[1] / errors[2]) / np.log(12 / 8)
    assert abs(order - 3.0) < 0.1, f"errors {errors}"
    assert errors[2] < 1e-4
