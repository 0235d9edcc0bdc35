"""A load log turned into what the thermal model is driven by, step by step.

Losses and films are evaluated at every load sample and then averaged over each step: powers are averaged, never
currents or speeds before a nonlinear law (paper 001, erratum E-001-4: 20 % duty at 10 A is a factor 5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Drive:
    """Per step of length dt (n steps); everything the same for the full model, the reduced model and calibration."""

    time: np.ndarray  # (n + 1,) s, step edges
    power: np.ndarray  # (n, n_sources) W, gains included
    theta: np.ndarray  # (n, n_theta) W/(m^2 K): films, then joints
    environment: np.ndarray  # (n, n_environments) degC
    conductance: np.ndarray  # (n, n_pairs) W/K
    weight: np.ndarray  # (n, n_pairs, n_segments) dwell mean of w, zero-padded to the longest rail
    square: np.ndarray  # (n, n_pairs, n_segments) dwell mean of w_i^2
    neighbour: np.ndarray  # (n, n_pairs, n_segments) dwell mean of w_i w_{i+1}; last column zero
    position: np.ndarray  # (n, n_axes) m at the end of each step
    flags: np.ndarray  # (n,) uint32, bit k set: flag_names[k] holds in this step
    flag_names: tuple[str, ...]  # e.g. "signals.x_current above 20 A", "gap in loads"

    @property
    def n_steps(self) -> int:
        return len(self.time) - 1
