"""NAFEMS T2, T3 and T4 as machines: described, built and run by the full and the reduced model.

Barlow and Davis, Selected FE Benchmarks in Structural and Thermal Analysis, NAFEMS FEBSTA (1986). Prescribed
temperatures are those of an environment behind a film of 1e8 W/(m^2 K).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.reference import described as d
from tests.reference.models import Steps, run_both
from tests.reference.row import Case, judge
from tests.reference.test_nafems_t3 import series as t3_series
from tests.reference.test_nafems_t4 import series as t4_series
from twin.build.pipeline import BuildOptions
from twin.build.rich_basis import RichOptions
from twin.physics.radiation import STEFAN_BOLTZMANN, ZERO_CELSIUS

PRESCRIBED = 1e8  # W/(m^2 K): its resistance is below 1e-5 of the bars'
SOURCE = "Barlow, Davis, Selected FE Benchmarks, NAFEMS 1986, test"
NOTHING = {"nothing": ("1", np.zeros(2))}


def bar(name: str, conductivity: float, density: float, heat_capacity: float, divisions: int, sensor: float) -> str:
    """A bar of 0.1 m along x."""
    return (
        d.material("metal", conductivity, density, heat_capacity)
        + d.box("bar", "metal", (0.1, 0.005, 0.005), (divisions, 1, 1), "y_min y_max z_min z_max")
        + d.sensor(name, "bar", (sensor, 0.0025, 0.0025))
        + d.displaced("bar.x_max", (0.1, 0.0, 0.0), "bar.x_min")
        + d.held("bar")
    )


@pytest.mark.long
def test_nafems_t2_radiation(tmp_path: Path):
    hot, cold = 1000.0 - ZERO_CELSIUS, 300.0 - ZERO_CELSIUS
    radiating = d.film("cold", 1e-6, "bar.x_max", "cold").replace("emissivity = 0.0", "emissivity = 0.98")
    text = (
        d.head("T2")
        + bar("end", 55.6, 7850.0, 460.0, 10, 0.1)
        + d.constant_air("hot", hot)
        + d.constant_air("cold", cold)
        + d.film("hot", PRESCRIBED, "bar.x_min", "hot")
        + radiating
    )
    both = run_both(tmp_path, text, np.array([0.0, 7200.0]), NOTHING, Steps(start=cold), BuildOptions())

    def lost(T: float) -> float:  # W/m^2 beyond what the bar conducts to an end of T [K]
        return 0.98 * STEFAN_BOLTZMANN * (T**4 - 300.0**4) - 55.6 / 0.1 * (1000.0 - T)

    exact = brentq(lost, 300.0, 1000.0)
    assert abs(exact - 927.0) < 0.5  # K, the published, rounded target
    full, reduced = (ZERO_CELSIUS + m.temperature["end"][-1:] for m in (both.full, both.reduced))
    judge(
        Case("NAFEMS T2: radiating bar, steady", f"{SOURCE} T2", "T at the radiating end", "K"),
        np.array([exact]), full, reduced, 700.0,
    )  # fmt: skip


def test_nafems_t3_transient(tmp_path: Path):
    text = (
        d.head("T3")
        + bar("E", 35.0, 7200.0, 440.5, 20, 0.08)
        + d.measured_air("hot", 0.0, 100.0)
        + d.constant_air("cold", 0.0)
        + d.film("hot", PRESCRIBED, "bar.x_max", "hot")
        + d.film("cold", PRESCRIBED, "bar.x_min", "cold")
    )
    sampling, dt = 0.1, 0.5  # s
    time = np.arange(round(32.0 / sampling) + 1) * sampling
    # samples hold until the next one: each is the temperature half way to it
    columns = {"hot": ("degC", 100.0 * np.sin(np.pi * (time + sampling / 2) / 40.0))}
    # a reduced model for steps of half a second: its modes reach to the pole that such a step is solved at
    options = BuildOptions(rich=RichOptions(shift_high=1.0 / (0.343 * dt)))
    both = run_both(tmp_path, text, time, columns, Steps(dt=dt), options)
    exact = np.array([0.0, *(t3_series(0.08, t) for t in both.full.time[1:])])
    assert abs(exact[-1] - 36.60) < 0.005  # degC, the published target
    judge(
        Case("NAFEMS T3: bar with an oscillating end", f"{SOURCE} T3", "T at 0.08 m, 0 .. 32 s in steps of 0.5 s"),
        exact, both.full.temperature["E"], both.reduced.temperature["E"],
    )  # fmt: skip


@pytest.mark.long
def test_nafems_t4_convection(tmp_path: Path):
    text = (
        d.head("T4")
        + d.material("metal", 52.0, 7850.0, 460.0)
        + d.box("plate", "metal", (0.6, 1.0, 0.05), (12, 20, 1), "x_min z_min z_max")
        + d.constant_air("hot", 100.0)
        + d.constant_air("cold", 0.0)
        + d.film("hot", PRESCRIBED, "plate.y_min", "hot")
        + d.film("cold", 750.0, "plate.x_max plate.y_max", "cold")
        + d.sensor("E", "plate", (0.6, 0.2, 0.025))
        + d.displaced("plate.y_max", (0.3, 1.0, 0.0), "plate.y_min")
        + d.held("plate")
    )
    both = run_both(tmp_path, text, np.array([0.0, 3e5]), NOTHING, Steps(dt=3000.0), BuildOptions())
    judge(
        Case("NAFEMS T4: plate with films, steady", f"{SOURCE} T4", "T at (0.6, 0.2) m"),
        np.array([t4_series(0.6, 0.2)]), both.full.temperature["E"][-1:], both.reduced.temperature["E"][-1:], 18.25,
    )  # fmt: skip
