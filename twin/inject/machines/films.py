"""Films of drawn machines: measured coefficients, correlations of free convection, and films that follow a speed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from twin.inject.machines.draws import about, one_of, with_unit

LUMP = "W/(m^2*K)"
NATURAL = 8.5  # W/(m^2 K), radiation in it: a painted wall of a shop, some K warmer than the air
FREE = ("free_vertical_plate", "free_box")


def still_film(rng: np.random.Generator, surfaces: Sequence[str], environment: str, height: int) -> dict[str, Any]:
    """A film of parts that rest; height [mm]: of their walls."""
    law = one_of(rng, ("constant_film", "constant_film", *FREE))
    if law == "constant_film":
        return constant_film(rng, surfaces, environment)
    size = {"height": with_unit(height, "mm")}
    if law == "free_box":
        size = {"length": with_unit(4 * height, "mm"), "width": with_unit(2 * height, "mm"), **size}
    return _film(law, surfaces, environment, one_of(rng, (0.8, 0.85, 0.9)), size)


def moved_film(
    rng: np.random.Generator, surfaces: Sequence[str], environment: str, length: int, speed: str
) -> dict[str, Any]:
    """A film of parts that move through the air; length [mm]: of them along the motion; speed: the signal."""
    law = one_of(rng, ("forced_film", "forced_film", "mixed_plate"))
    if law == "mixed_plate":
        size = {"length": with_unit(length, "mm"), "height": with_unit(length // 3, "mm")}
        return {**_film(law, surfaces, environment, 0.8, size), "signals": {"speed": speed}}
    values = {"natural": with_unit(about(rng, NATURAL, 0.2), LUMP), "forced": with_unit(about(rng, 15.0, 0.3), LUMP)}
    return {**_film(law, surfaces, environment, 0.0, values), "signals": {"speed": speed}}


def constant_film(rng: np.random.Generator, surfaces: Sequence[str], environment: str) -> dict[str, Any]:
    """A measured coefficient: radiation is in it."""
    values = {"natural": with_unit(about(rng, NATURAL, 0.2), LUMP)}
    return _film("constant_film", surfaces, environment, 0.0, values)


def _film(
    law: str, surfaces: Sequence[str], environment: str, emissivity: float, parameters: dict[str, Any]
) -> dict[str, Any]:
    return {
        "law": law,
        "surfaces": list(surfaces),
        "environment": environment,
        "emissivity": emissivity,
        "parameters": parameters,
    }
