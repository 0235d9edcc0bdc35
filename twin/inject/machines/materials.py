"""Materials of drawn machines: values of tables, some per cent aside, as suppliers differ."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from twin.inject.machines.draws import about
from twin.machine.toml_text import Table

SPREAD = 0.03  # of logarithms
# W/(m K), kg/m^3, J/(kg K), GPa, 1, 1e-6/K
VALUES = {
    "cast_iron": (50.0, 7200.0, 500.0, 120.0, 0.26, 10.5),
    "steel": (45.0, 7850.0, 470.0, 210.0, 0.29, 11.7),
    "aluminium": (160.0, 2700.0, 900.0, 70.0, 0.33, 23.0),
    "mineral_casting": (2.5, 2350.0, 850.0, 40.0, 0.25, 13.0),  # epoxy with granite
    "motor": (30.0, 6000.0, 450.0, 12.0, 0.3, 12.0),  # laminations, copper and housing, smeared
}


def material_tables(rng: np.random.Generator, used: Iterable[str]) -> tuple[Table, ...]:
    """Tables of the materials that are used, in the order of VALUES; all are drawn, so that none moves another."""
    drawn = {name: [about(rng, v, SPREAD) for v in values] for name, values in VALUES.items()}
    wanted = set(used)
    return tuple(
        Table(
            f"materials.{name}",
            {
                "conductivity": f"{k:g} W/(m*K)",
                "density": f"{rho:g} kg/m^3",
                "heat_capacity": f"{c:g} J/(kg*K)",
                "youngs_modulus": f"{stiff:g} GPa",
                "poisson_ratio": min(ratio, 0.4),
                "expansion": f"{alpha:g}e-6 1/K",
            },
        )
        for name, (k, rho, c, stiff, ratio, alpha) in drawn.items()
        if name in wanted
    )
