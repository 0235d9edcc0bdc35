"""NAFEMS T3: one-dimensional transient heat transfer, on a bar of quadratic tetrahedra.

Barlow and Davis, Selected FE Benchmarks in Structural and Thermal Analysis, NAFEMS FEBSTA (1986). Bar of 0.1 m,
lambda = 35 W/(m K), c = 440.5 J/(kg K), rho = 7200 kg/m^3; T(0) = 0, T(0.1 m) = 100 sin(pi t/40 s), T = 0 at first.
Target at x = 0.08 m and t = 32 s: 36.60 degC.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from tests.build.parts import STEEL, box
from twin.build.factorize import factorize
from twin.build.probe import probe
from twin.build.thermal import part_matrices

TARGET = 36.60  # degC


def series(x: float, t: float, terms: int = 200) -> float:
    """T = x/L f(t) + sum_n a_n(t) sin(n pi x/L), a_n driven by -f'(t) times the sine coefficients of x/L (Duhamel)."""
    length, alpha, omega = 0.1, 35.0 / (7200.0 * 440.5), np.pi / 40
    n = np.arange(1, terms + 1)
    k = alpha * (n * np.pi / length) ** 2
    b = 2 * (-1.0) ** (n + 1) / (n * np.pi)
    memory = (k * np.cos(omega * t) + omega * np.sin(omega * t) - k * np.exp(-k * t)) / (k**2 + omega**2)
    return float(100 * (x / length * np.sin(omega * t) - omega * (b * memory * np.sin(n * np.pi * x / length)).sum()))


def test_nafems_t3():
    material = STEEL.model_copy(update={"conductivity": 35.0, "heat_capacity": 440.5, "density": 7200.0})
    part = box("bar", (0.0, 0.0, 0.0), (0.1, 0.005, 0.005), (20, 1, 1))
    E, A0 = part_matrices(part, material)
    x = part.nodes[:, 0]
    ends, free = np.flatnonzero((x < 1e-9) | (x > 0.1 - 1e-9)), np.flatnonzero((x > 1e-9) & (x < 0.1 - 1e-9))
    at_hot = x[ends] > 0.05
    dt = 0.1  # s, Crank-Nicolson
    left, right = (sp.csr_array(E / dt + A0 / 2), sp.csr_array(E / dt - A0 / 2))
    factor = factorize(sp.csr_array(left[free][:, free]))
    T = np.zeros(part.n)
    for step in range(1, 321):
        load = right[free] @ T
        T[ends] = np.where(at_hot, 100.0 * np.sin(np.pi * step * dt / 40), 0.0)
        T[free] = factor.solve(load - left[free][:, ends] @ T[ends])
    nodes, weights = probe(part, np.array([0.08, 0.0025, 0.0025]), "T3")
    obtained = float(weights @ T[nodes])
    assert abs(series(0.08, 32.0) - TARGET) < 0.01
    assert abs(obtained - TARGET) / TARGET < 2e-3
