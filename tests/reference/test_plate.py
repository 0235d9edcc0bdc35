"""A plate heated from below that loses heat everywhere else: the runtime with its defaults, every minute of ten hours.

Exact: the sum over products of the eigenfunctions of three slabs (Carslaw and Jaeger, Conduction of Heat in Solids, 2nd
ed., Oxford 1959, section 3.11 and chapter 6), each driven by the flux at the bottom.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.reference import described as d
from tests.reference.models import Steps, run_both
from tests.reference.row import Case, judge
from twin.build.pipeline import BuildOptions

SIZE = (0.5, 1.0, 0.05)  # m
CONDUCTIVITY, CAPACITY = 50.0, 8000.0 * 500.0  # W/(m K), J/(m^3 K)
FILM, AIR, POWER = 10.0, 20.0, 1000.0  # W/(m^2 K), degC, W
AT = {"bottom": (0.25, 0.5, 0.0), "top": (0.25, 0.5, 0.05), "corner": (0.5, 1.0, 0.05), "low_corner": (0.0, 0.0, 0.0)}


def roots(ratio: float, length: float, count: int) -> np.ndarray:
    """b [1/m] of cos(b x), adiabatic at 0 and with a film at `length`: b tan(b length) = ratio = h / k."""
    low, high = np.arange(count) * np.pi / length, (np.arange(count) + 0.5) * np.pi / length
    for _ in range(60):
        middle = (low + high) / 2
        below = middle * np.tan(middle * length) < ratio
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return (low + high) / 2


def series(point: tuple[float, float, float], time: np.ndarray, across: int = 20, through: int = 3000) -> np.ndarray:
    """degC (n,) at times [s]; the plate is at AIR first."""
    ratio = FILM / CONDUCTIVITY
    b, share = [], []
    for x, size in zip(point[:2], SIZE[:2], strict=True):  # symmetric about the middle
        beta = roots(ratio, size / 2, across)
        norm = size / 4 + np.sin(beta * size) / (4 * beta)
        b.append(beta)
        share.append(np.sin(beta * size / 2) / beta / norm * np.cos(beta * (x - size / 2)))
    beta = roots(ratio, SIZE[2], through)
    norm = SIZE[2] / 2 + np.sin(2 * beta * SIZE[2]) / (4 * beta)
    # the flux enters where cos is 1
    z = POWER / (SIZE[0] * SIZE[1]) / CONDUCTIVITY * np.cos(beta * point[2]) / norm
    separate = b[0][:, None, None] ** 2 + b[1][None, :, None] ** 2 + beta**2
    weight = share[0][:, None, None] * share[1][None, :, None] * z / separate
    keep = np.abs(weight) > 1e-9  # K
    fading = CONDUCTIVITY / CAPACITY * separate[keep]
    slow = fading < 0.7  # 1/s: what is faster is over within a minute (exp(-42))
    decay = np.exp(-np.outer(time, fading[slow])) @ weight[keep][slow]
    return np.asarray(AIR + weight.sum() - decay)


@pytest.mark.long
def test_plate_in_the_steps_of_the_runtime(tmp_path: Path):
    text = (
        d.head("plate", AIR)
        + d.material("steel", CONDUCTIVITY, 8000.0, 500.0)
        + d.box("plate", "steel", SIZE, (6, 12, 3), "z_min")
        + d.constant_air("air", AIR)
        + d.film("air", FILM, "plate.*", "air")
        + d.switched_source("heater", POWER, "plate.z_min")
        + "".join(d.sensor(name, "plate", point) for name, point in AT.items())
        + d.displaced("plate.x_max", (0.5, 0.5, 0.025), "plate.x_min")
        + d.held("plate")
    )
    # fewer scenarios than usual certify it; how it is stepped does not depend on them
    built = run_both(
        tmp_path, text, np.array([0.0, 36000.0]), {"heater": ("1", np.ones(2))}, Steps(start=AIR, substeps=None),
        BuildOptions(held_out=2),
    )  # fmt: skip
    names = list(AT)
    exact = np.column_stack([series(AT[n], built.full.time[1:]) for n in names])
    full, reduced = (np.column_stack([m.temperature[n][1:] for n in names]) for m in (built.full, built.reduced))
    assert np.abs(reduced - exact).max() < 0.02  # K
    judge(
        Case("plate heated from below", "Carslaw, Jaeger 1959, 3.11 and ch. 6", "T at 4 places, every minute of 10 h"),
        exact, full, reduced,
    )  # fmt: skip
