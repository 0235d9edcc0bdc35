"""Dry air at one atmosphere by temperature."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from twin.physics.radiation import ZERO_CELSIUS

GRAVITY = 9.80665  # m/s^2
LOWEST, HIGHEST = 0.0, 80.0  # degC of the table

# CoolProp at 101325 Pa. degC; kg/m^3; J/(kg K); W/(m K); 1e-5 m^2/s; 1e-5 m^2/s
_TABLE = np.array([
    [0.0, 1.2931, 1005.7, 0.02436, 1.3316, 1.8733],
    [20.0, 1.2046, 1006.1, 0.02587, 1.5114, 2.1348],
    [25.0, 1.1843, 1006.3, 0.02625, 1.5577, 2.2023],
    [40.0, 1.1274, 1006.9, 0.02735, 1.6999, 2.4095],
    [60.0, 1.0596, 1008.0, 0.02880, 1.8968, 2.6967],
    [80.0, 0.9995, 1009.5, 0.03023, 2.1019, 2.9957],
])  # fmt: skip


def _continued(table: np.ndarray, low: float, high: float) -> np.ndarray:
    """The table with its first and last interval extrapolated linearly to `low` and `high`."""
    first = table[0] + (low - table[0, 0]) / (table[1, 0] - table[0, 0]) * (table[1] - table[0])
    last = table[-1] + (high - table[-1, 0]) / (table[-1, 0] - table[-2, 0]) * (table[-1] - table[-2])
    return np.vstack([first, table, last])


_CONTINUED = _continued(_TABLE, -40.0, 150.0)


class Air(NamedTuple):
    """Properties in SI, all of one shape."""

    density: Any  # kg/m^3
    heat_capacity: Any  # J/(kg K)
    conductivity: Any  # W/(m K)
    viscosity: Any  # m^2/s, kinematic
    diffusivity: Any  # m^2/s, thermal
    expansion: Any  # 1/K, of an ideal gas

    @property
    def prandtl(self):
        return self.viscosity / self.diffusivity


def air(temperature) -> Air:
    """Properties at a temperature [degC], number or array; linear between the rows of the table.

    0 to 80 degC: within 0.2 % of CoolProp. From there to -40 and 150 degC the outer intervals are extrapolated linearly
    (within 6 %, see the test), beyond that the values are held; the laws flag all of it.
    Source: CoolProp at 101325 Pa; linear interpolation as in paper 004, Fig. 5.
    """
    columns = [jnp.interp(temperature, _CONTINUED[:, 0], column) for column in _CONTINUED.T[1:]]
    density, heat_capacity, conductivity, viscosity, diffusivity = columns
    kelvin = jnp.maximum(temperature + ZERO_CELSIUS, 100.0)
    return Air(density, heat_capacity, conductivity, viscosity * 1e-5, diffusivity * 1e-5, 1.0 / kelvin)


def in_table(temperature):
    """Whether the properties of air at a temperature [degC] come from the table itself."""
    return (temperature >= LOWEST) & (temperature <= HIGHEST)
