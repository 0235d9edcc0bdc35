"""Thermal bending and growth: a bimetal strip, and a bar with a temperature gradient through its thickness."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.reference import described as d
from tests.reference.models import Steps, run_both
from tests.reference.row import Case, judge
from tests.reference.strips import part, write_bar
from twin.build.pipeline import BuildOptions

STEEL = (210e9, 0.3, 11.5e-6)  # Pa, 1, 1/K
ALUMINIUM = (70e9, 0.3, 23e-6)
NOTHING = {"nothing": ("1", np.zeros(2))}


def curvature(lower: tuple[float, float], upper: tuple[float, float], thickness: tuple[float, float]) -> float:
    """1/m per kelvin of a strip of two layers, each (Young's modulus, expansion); positive: ends rise.

    Timoshenko, Analysis of bi-metal thermostats, J. Opt. Soc. Am. 11, 1925, eq (4). With equal Poisson's ratios it
    holds for wide strips as well: both layers have E / (1 - nu) instead of E.
    """
    m, n = thickness[0] / thickness[1], lower[0] / upper[0]
    share = 6 * (1 + m) ** 2 / (3 * (1 + m) ** 2 + (1 + m * n) * (m**2 + 1 / (m * n)))
    return (lower[1] - upper[1]) * share / sum(thickness)


@pytest.mark.long
def test_bimetal_strip(tmp_path: Path):
    # patches a thickness or more away from the free ends, whose stresses Timoshenko leaves out
    length, width, lower, upper, film, air = 0.2, 0.01, 0.003, 0.002, 2.0, 50.0
    edges = np.array([0.02, 0.03, 0.17, 0.18])
    write_bar(tmp_path / "lower.msh", (0.0, 0.0, 0.0), (length, width, lower), (40, 2, 1), 0.0, edges)
    sides = "x_min x_max y_min y_max"
    others = "base end flank strip_0 strip_2 strip_4"
    # "sides" holds what the strips are bonded along; its rest exchanges no heat
    text = (
        d.head("bimetal")
        + d.material("aluminium", 160.0, 2700.0, 900.0, ALUMINIUM)
        + d.material("steel", 45.0, 7850.0, 470.0, STEEL)
        + part("lower", "aluminium", "lower.msh", others)
        + d.box("upper", "steel", (length, width, upper), (40, 2, 1), sides, (0.0, 0.0, lower))
        + d.joint("seam", "lower.sides", "upper.z_min", 1e5)
        + d.constant_air("air", air)
        + d.film("air", film, "upper.z_max", "air")
        + d.film("patches", film, "lower.strip_1 lower.strip_3", "air")
        + d.displaced("lower.strip_3", (0.175, width / 2, 0.0), "lower.strip_1")
        + d.held("upper")
    )
    both = run_both(tmp_path, text, np.array([0.0, 14400.0]), NOTHING, Steps(), BuildOptions())
    kappa = curvature((ALUMINIUM[0], ALUMINIUM[2]), (STEEL[0], STEEL[2]), (lower, upper))
    area = length * width
    capacity = area * (lower * 2700.0 * 900.0 + upper * 7850.0 * 470.0)
    rate = film * (area + 2 * 0.01 * width) / capacity
    rise = air * (1.0 - np.exp(-rate * both.full.time[1:]))
    exact = 1e6 * kappa * (0.175 - 0.025) ** 2 / 2 * rise
    full, reduced = (1e6 * m.tcp[:, 2] for m in (both.full, both.reduced))
    judge(
        Case("bimetal strip", "Timoshenko, J. Opt. Soc. Am. 11, 1925, eq (4)",
             "deflection over 0.15 m, every minute of 4 h", "um"), exact, full, reduced,
    )  # fmt: skip


def test_bar_with_a_gradient(tmp_path: Path):
    length, width, height, film = 0.3, 0.04, 0.03, 2000.0
    text = (
        d.head("bar")
        + d.material("steel", 45.0, 7850.0, 470.0, STEEL)
        + d.box("bar", "steel", (length, width, height), (10, 2, 2), "x_min x_max y_min y_max")
        + d.constant_air("hot", 80.0)
        + d.constant_air("cold", 20.0)
        + d.film("hot", film, "bar.z_max", "hot")
        + d.film("cold", film, "bar.z_min", "cold")
        + d.displaced("bar.x_max", (length, width / 2, height / 2), "bar.x_min")
        + d.held("bar")
    )
    both = run_both(tmp_path, text, np.array([0.0, 14400.0]), NOTHING, Steps(), BuildOptions())
    flux = 60.0 / (2 / film + height / 45.0)
    gradient, mean = flux / 45.0, 50.0
    source = "Boley, Weiner, Theory of Thermal Stresses, Wiley 1960: linear T leaves no stress"
    exact = 1e6 * STEEL[2] * np.array([mean * length, -gradient * length**2 / 2])
    full, reduced = (1e6 * m.tcp[-1, [0, 2]] for m in (both.full, both.reduced))
    judge(
        Case("bar with a gradient, steady", source, "growth and deflection over 0.3 m", "um"),
        exact, full, reduced, float(np.abs(exact).min()),
    )  # fmt: skip
