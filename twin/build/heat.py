"""The heat balance of one step of the full model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

LEAST = 1e-6  # W: a balance is not judged against less than that


@dataclass(frozen=True)
class Heat:
    """Mean heat flows of one step [W]; what leaves one side of a contact enters the other, so contacts drop out."""

    power: np.ndarray  # (n_sources,)
    film: np.ndarray  # (n_films,) from the environments into the machine
    stored: float
    radiated: np.ndarray  # (n_films,) the part of `film` by radiation, at the step's start

    @property
    def balance_error(self) -> float:
        """|heat in - heat out - heat stored| / throughput (0.06; erratum E-000-3)."""
        rest = self.power.sum() + self.film.sum() - self.stored
        # radiation and convection of one film may cancel: each counts
        films = np.abs(self.film - self.radiated).sum() + np.abs(self.radiated).sum()
        throughput = np.abs(self.power).sum() + films + abs(self.stored)
        return float(abs(rest) / max(throughput, LEAST))
