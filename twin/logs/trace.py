"""One measured channel of one run beside what a model computes: plain data, so that the edge can carry it undrawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Trace:
    """Of n readings; temperatures in degC, displacements of the TCP in m."""

    run: str
    channel: str
    unit: str  # "degC" or "m"
    time: np.ndarray  # (n,) s
    logged: np.ndarray  # (n,) as the log has it, NaN where it has nothing
    used: np.ndarray  # (n,) what was compared with the model: NaN where set aside
    computed: np.ndarray  # (n,)
    wrong: str = ""  # what is wrong with the channel in this run, in words

    @property
    def as_logged(self) -> np.ndarray:
        """(n,) whether a reading was used as it stands in the log: neither set aside nor corrected."""
        return np.abs(self.used - self.logged) <= 1e-9 * np.abs(self.logged) + 1e-12  # means of the same readings

    @property
    def rms(self) -> float:
        """Of what was compared, used minus computed [K or m]; NaN where nothing was."""
        error = (self.used - self.computed)[np.isfinite(self.used)]
        return float(np.sqrt(np.mean(error**2))) if len(error) else float("nan")
