"""NAFEMS T4: two-dimensional heat transfer with convection, on an extruded mesh of quadratic tetrahedra.

Barlow and Davis, Selected FE Benchmarks in Structural and Thermal Analysis, NAFEMS FEBSTA (1986). Plate 0.6 m x 1.0 m,
lambda = 52 W/(m K); y = 0 at 100 degC, x = 0 insulated, x = 0.6 and y = 1 convect with 750 W/(m^2 K) to 0 degC.
Target at (0.6, 0.2): 18.3 degC; the series gives 18.2538.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from skfem import condense

from tests.build.parts import STEEL, box
from twin.build.factorize import factorize
from twin.build.probe import probe
from twin.build.surface import mass
from twin.build.thermal import part_matrices

SERIES = 18.2538  # degC


def series(x: float, y: float, terms: int = 400) -> float:
    """Separation of variables: sum of cos(b x) (cosh + ratio/b sinh)(b (1 - y)), b tan(0.6 b) = h/lambda."""
    ratio, width, height = 750.0 / 52.0, 0.6, 1.0
    low, high = np.arange(terms) * np.pi / width, (np.arange(terms) + 0.5) * np.pi / width
    for _ in range(60):  # b tan(b width) rises from 0 to infinity in each interval
        middle = (low + high) / 2
        below = middle * np.tan(middle * width) < ratio
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    b = (low + high) / 2
    share = 4 * np.sin(b * width) / (2 * b * width + np.sin(2 * b * width))  # of the constant 1

    # cosh(b (H - y)) + ratio/b sinh(b (H - y)), scaled by exp(-b H) against overflow
    def profile(distance: float) -> np.ndarray:
        grow, fall = np.exp(b * (distance - height)), np.exp(-b * (distance + height))
        return (grow + fall) / 2 + ratio / b * (grow - fall) / 2

    return float(100.0 * (share * np.cos(b * x) * profile(height - y) / profile(height)).sum())


def test_nafems_t4():
    material = STEEL.model_copy(update={"conductivity": 52.0})
    part = box("plate", (0.0, 0.0, 0.0), (0.6, 1.0, 0.05), (24, 40, 1))
    _, A0 = part_matrices(part, material)
    cooled = np.concatenate([part.facets("x_max"), part.facets("y_max")])
    K = sp.csr_matrix(A0 + 750.0 * mass(part, cooled))
    hot = np.flatnonzero(part.nodes[:, 1] < 1e-9)
    T = np.zeros(part.n)
    T[hot] = 100.0
    reduced, load, T, free = condense(K, np.zeros(part.n), x=T, D=hot)
    T[free] = factorize(sp.csr_array(reduced)).solve(load)
    nodes, weights = probe(part, np.array([0.6, 0.2, 0.025]), "T4")
    obtained = float(weights @ T[nodes])
    assert abs(series(0.6, 0.2) - SERIES) < 1e-3
    assert abs(obtained - SERIES) / SERIES < 1e-3
    assert abs(obtained - 18.3) / 18.3 < 5e-3  # the published, rounded target
