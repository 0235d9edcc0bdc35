"""Slabs of one and of two layers with contact resistance, heated through a film: transient and steady.

In two steps a minute: the air changes at once, and in a step of a minute both models miss 0.23 % of the range at first.

One layer: Carslaw and Jaeger, Conduction of Heat in Solids, 2nd ed., Oxford 1959, section 3.11. Two layers: Ozisik,
Heat Conduction, 2nd ed., Wiley 1993, chapter 8 (orthogonal expansion over composite media), with a contact conductance
in the condition at the interface; steady: resistances in series, Carslaw and Jaeger, section 3.2.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.reference import described as d
from tests.reference.layers import Layer, Wall
from tests.reference.models import Computed, Steps, run_both
from tests.reference.row import Case, judge
from twin.build.pipeline import BuildOptions

AIR = 60.0  # degC, beyond the film at the left; the slabs begin at zero
SIDES = "y_min y_max z_min z_max"


def one_layer(beta_of: float, x: np.ndarray, fourier: np.ndarray, count: int = 60) -> np.ndarray:
    """Carslaw and Jaeger's series of a slab with film at x = 1, adiabatic at 0: share of AIR (n, k).

    beta tan(beta) = Biot number.
    """
    low, high = np.arange(count) * np.pi, (np.arange(count) + 0.5) * np.pi
    for _ in range(60):
        middle = (low + high) / 2
        below = middle * np.tan(middle) < beta_of
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    b = (low + high) / 2
    share = 2 * np.sin(b) / (b + np.sin(b) * np.cos(b))
    return 1.0 - np.exp(-np.outer(fourier, b**2)) @ (share[:, None] * np.cos(np.outer(b, x)))


def of_sensors(m: Computed, names: list[str]) -> np.ndarray:
    return np.column_stack([m.temperature[n] for n in names])


def test_slab_heated_through_a_film(tmp_path: Path):
    length, film = 0.1, 500.0
    layer = Layer(length, 45.0, 7850.0 * 470.0)
    text = (
        d.head("slab")
        + d.material("steel", 45.0, 7850.0, 470.0)
        + d.box("slab", "steel", (length, 0.02, 0.02), (12, 1, 1), f"x_max {SIDES}")
        + d.constant_air("hot", AIR)
        + d.film("hot", film, "slab.x_min", "hot")
        + "".join(d.sensor(f"s{i}", "slab", (x, 0.01, 0.01)) for i, x in enumerate((0.0, 0.03, 0.1)))
        + d.displaced("slab.x_max", (length, 0.0, 0.0), "slab.x_min")
        + d.held("slab")
    )
    both = run_both(
        tmp_path, text, np.array([0.0, 7200.0]), {"nothing": ("1", np.zeros(2))}, Steps(substeps=2, full=2),
        BuildOptions(),
    )  # fmt: skip
    names, x = ["s0", "s1", "s2"], np.array([0.0, 0.03, 0.1])
    time = both.full.time[1:]
    fourier = layer.conductivity / layer.capacity * time / length**2
    exact = AIR * one_layer(film * length / layer.conductivity, 1.0 - x / length, fourier)
    wall = Wall((layer,), 1.0, film, 0.0)
    assert wall.temperature(AIR, (x,), time) == pytest.approx(exact, abs=1e-6)  # the other series is right, too
    judge(
        Case("slab heated through a film", "Carslaw, Jaeger 1959, 3.11", "T at 3 depths, every minute of 2 h"),
        exact, of_sensors(both.full, names)[1:], of_sensors(both.reduced, names)[1:], AIR,
    )  # fmt: skip


@pytest.mark.long
def test_two_bodies_with_contact_resistance(tmp_path: Path):
    a, b = Layer(0.05, 160.0, 2700.0 * 900.0), Layer(0.08, 45.0, 7850.0 * 470.0)
    left, contact, right = 1000.0, 2000.0, 200.0
    text = (
        d.head("two")
        + d.material("aluminium", 160.0, 2700.0, 900.0)
        + d.material("steel", 45.0, 7850.0, 470.0)
        + d.box("a", "aluminium", (0.05, 0.02, 0.02), (6, 1, 1), SIDES)
        + d.box("b", "steel", (0.08, 0.02, 0.02), (10, 1, 1), SIDES, (0.05, 0.0, 0.0))
        + d.joint("seam", "a.x_max", "b.x_min", contact)
        + d.constant_air("hot", AIR)
        + d.constant_air("cold", 0.0)
        + d.film("hot", left, "a.x_min", "hot")
        + d.film("cold", right, "b.x_max", "cold")
        + d.sensor("a0", "a", (0.0, 0.01, 0.01))
        + d.sensor("a1", "a", (0.05, 0.01, 0.01))
        + d.sensor("b0", "b", (0.05, 0.01, 0.01))
        + d.sensor("b1", "b", (0.13, 0.01, 0.01))
        + d.displaced("b.x_max", (0.13, 0.0, 0.0), "a.x_min")
        + d.held("a")
    )
    both = run_both(
        tmp_path, text, np.array([0.0, 21600.0]), {"nothing": ("1", np.zeros(2))}, Steps(substeps=2, full=2),
        BuildOptions(),
    )  # fmt: skip
    names, at = ["a0", "a1", "b0", "b1"], (np.array([0.0, 0.05]), np.array([0.0, 0.08]))
    wall = Wall((a, b), contact, left, right)
    exact = wall.temperature(AIR, at, both.full.time[1:])
    full, reduced = (of_sensors(m, names)[1:] for m in (both.full, both.reduced))
    judge(
        Case("two bodies with contact resistance", "Ozisik, Heat Conduction 1993, ch. 8",
             "T at both sides of both bodies, every minute of 6 h"), exact, full, reduced, AIR,
    )  # fmt: skip
    steady = np.concatenate(wall.steady(AIR, at))
    judge(
        Case("the same, steady", "Carslaw, Jaeger 1959, 3.2", "the same four temperatures after 6 h"),
        steady, full[-1], reduced[-1], AIR,
    )  # fmt: skip
