"""Steady straight fin that loses heat by any law of its own temperature: the first integral of k t T'' = q(T).

Kraus, Aziz and Welty, Extended Surface Heat Transfer, Wiley 2001, ch. 8 (radiating fins); the same step for power laws
of convection: Sen and Trinh, J. Heat Transfer 108, 1986.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

GAUSS = np.polynomial.legendre.leggauss(60)
NODES, WEIGHTS = (GAUSS[0] + 1) / 2, GAUSS[1] / 2


@dataclass(frozen=True)
class Fin:
    """Base at one temperature, end adiabatic; one side loses heat."""

    conductivity: float  # W/(m K)
    thickness: float  # m
    length: float  # m
    base: float  # degC
    flux: Callable[[np.ndarray], np.ndarray]  # W/m^2 lost at temperatures [degC], zero at `air`
    air: float  # degC

    def _distance(self, T: float, end: float) -> float:
        """From the adiabatic end, of temperature `end`, to where it is T; with s^2 = T - end nothing is singular.

        (k t/2) T'^2 = G = int_end^T q dT' = s^2 int_0^1 q(end + s^2 u) du
        """
        s = np.sqrt(T - end) * NODES
        mean = self.flux(end + np.outer(s**2, NODES)) @ WEIGHTS
        return float(np.sqrt(T - end) * WEIGHTS @ (2.0 / np.sqrt(2.0 / (self.conductivity * self.thickness) * mean)))

    @property
    def end(self) -> float:
        """degC of the adiabatic end."""
        low, high = self.air + 1e-6 * (self.base - self.air), self.base - 1e-9
        return float(brentq(lambda end: self._distance(self.base, end) - self.length, low, high, xtol=1e-12))

    def temperature(self, x: float) -> float:
        """degC at x [m] from the base."""
        end, wanted = self.end, self.length - x
        if wanted <= 0.0:
            return end
        return float(brentq(lambda T: self._distance(T, end) - wanted, end + 1e-12, self.base, xtol=1e-12))
