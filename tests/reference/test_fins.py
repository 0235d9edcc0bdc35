"""Fins whose film follows their temperature: radiation alone, and free convection alone.

A film follows the mean temperature of its surfaces, so the fin's side is cut into strips, each with a film of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.reference import described as d
from tests.reference.fin import Fin
from tests.reference.models import Both, Steps, run_both
from tests.reference.row import Case, judge
from tests.reference.strips import part, strip, write_bar
from twin.build.pipeline import BuildOptions
from twin.physics.free_convection import free_horizontal_up_incropera
from twin.physics.radiation import STEFAN_BOLTZMANN, ZERO_CELSIUS

LENGTH, WIDTH, THICKNESS = 0.24, 0.02, 0.004  # m
CONDUCTIVITY = 45.0
STRIPS = 12
AIR = 20.0  # degC
AT = (0.06, 0.12, 0.24)  # m from the base
EDGES = np.linspace(0.0, LENGTH, STRIPS + 1)
PATCH = 0.08  # m: length over which free convection is taken


def fin_of(base: float, flux: Callable[[np.ndarray], np.ndarray]) -> Fin:
    return Fin(CONDUCTIVITY, THICKNESS, LENGTH, base, flux, AIR)


def steady(folder: Path, base: float, law: str) -> Both:
    """Both models of the fin, after eight hours with its base at a temperature [degC]; law: of every strip's film."""
    write_bar(folder / "fin.msh", (0.0, 0.0, 0.0), (LENGTH, WIDTH, THICKNESS), (24, 1, 1), THICKNESS, EDGES[1:])
    films = "".join(f'[films.f{i}]\nsurfaces = ["fin.{strip(i)}"]\nenvironment = "air"\n{law}\n' for i in range(STRIPS))
    text = (
        d.head("fin", AIR)
        + d.material("steel", CONDUCTIVITY, 7850.0, 470.0)
        + part("fin", "steel", "fin.msh", "sides flank end")
        + d.constant_air("base", base)
        + d.constant_air("air", AIR)
        + d.film("base", 1e8, "fin.base", "base")
        + films
        + "".join(d.sensor(f"s{i}", "fin", (x, WIDTH / 2, THICKNESS / 2)) for i, x in enumerate(AT))
        + d.displaced("fin.end", (LENGTH, 0.0, 0.0), "fin.base")
        + d.held("fin", "base", "sides", "flank")
    )
    return run_both(
        folder, text, np.array([0.0, 28800.0]), {"nothing": ("1", np.zeros(2))}, Steps(start=AIR), BuildOptions()
    )


def of_sensors(both: Both) -> tuple[np.ndarray, np.ndarray]:
    return tuple(np.array([m.temperature[f"s{i}"][-1] for i in range(len(AT))]) for m in (both.full, both.reduced))


@pytest.mark.long
def test_radiating_fin(tmp_path: Path):
    def flux(T: np.ndarray) -> np.ndarray:
        return STEFAN_BOLTZMANN * ((T + ZERO_CELSIUS) ** 4 - (AIR + ZERO_CELSIUS) ** 4)

    base = 140.0
    law = 'law = "constant_film"\nemissivity = 1.0\nparameters = { natural = 1e-9 }'
    exact = np.array([fin_of(base, flux).temperature(x) for x in AT])
    full, reduced = of_sensors(steady(tmp_path, base, law))
    source = "Kraus, Aziz, Welty, Extended Surface Heat Transfer 2001, ch. 8"
    judge(Case("radiating fin, steady", source, "T at 3 places"), exact, full, reduced, base - AIR)


@pytest.mark.long
def test_fin_in_free_convection(tmp_path: Path):
    def flux(T: np.ndarray) -> np.ndarray:
        return np.asarray(free_horizontal_up_incropera(T, AIR, PATCH)) * (T - AIR)

    base = 75.0  # degC
    law = f'law = "free_horizontal_up_incropera"\nemissivity = 0.0\nparameters = {{ length = {PATCH} }}'
    exact = np.array([fin_of(base, flux).temperature(x) for x in AT])
    full, reduced = of_sensors(steady(tmp_path, base, law))
    source = "first integral of k t T'' = h(T) (T - T_air), as Sen, Trinh, J. Heat Transfer 108, 1986"
    judge(Case("fin in free convection, steady", source, "T at 3 places"), exact, full, reduced, base - AIR)


def test_the_first_integral_meets_the_fin_with_constant_film():
    """Incropera, Fundamentals of Heat and Mass Transfer, 7th ed., Table 3.4, case B: cosh(m (L - x)) / cosh(m L)."""
    m = np.sqrt(8.0 / (CONDUCTIVITY * THICKNESS))
    for x in AT:
        exact = AIR + 100.0 * np.cosh(m * (LENGTH - x)) / np.cosh(m * LENGTH)
        assert fin_of(AIR + 100.0, lambda T: 8.0 * (T - AIR)).temperature(x) == pytest.approx(exact, abs=1e-6)
