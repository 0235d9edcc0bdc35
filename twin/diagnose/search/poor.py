"""A model too poor to diagnose (`twin.diagnose.search.dispersion`): where it fits worst, when, and which body that
follows one logged column with one lag resembles most what is left there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.calibrate.fit.measured import Measured
from twin.calibrate.members.driver import drivers_of
from twin.calibrate.members.responses import Candidate, candidates, responses
from twin.diagnose.search.dispersion import Dispersion
from twin.diagnose.search.gain import predicted
from twin.diagnose.search.look import Search
from twin.logs.run import Run


@dataclass(frozen=True)
class Piece:
    """A sensor where the model fits badly, and what would help."""

    sensor: str
    rms: float  # K, of what is left in all fitted runs
    run: str  # with the worst hour
    hour: float  # h, where that begins
    by: Candidate | None  # None where nothing was logged
    share: float  # of the mean square that is left, which a body that follows it would explain

    @property
    def words(self) -> str:
        help_ = "" if self.by is None else f": a body that {self.by.words} would explain {self.share:.0%} of it"
        return f"{self.sensor} {self.rms:.2g} K (worst from {self.hour:.0f} h of {self.run}){help_}"


def poor_note(
    found: Search, plans: Sequence[Measured], runs: Sequence[Run], sigma: float, dispersion: Dispersion
) -> str:
    """In words, with the sensors that fit worst and what would help there; sigma [K] of one reading."""
    policy = found.detector.policy
    variance = f"{dispersion.share:.2g} times the variance that noise and model discrepancy have"
    if dispersion.share > policy.dispersed:
        told = (
            f"the model is too poor: even the best explanation leaves {variance}, and a cause must explain "
            f"{policy.excess:.0%} of what is left beside slow errors of single channels"
        )
    else:
        told = f"even the best explanation leaves {variance}: a cause must explain {policy.excess:.0%} of the excess"
    sensors = plans[0].sensors
    if not sensors or any(m.sensors != sensors for m in plans[: len(runs)]):
        return told
    errors = []
    for k, m in enumerate(plans[: len(runs)]):
        flat = predicted(found, k).extended
        errors.append(m.temperature - found.detector.study.runs[k].split(flat)[0])
    rms = np.nan_to_num(np.sqrt(np.nanmean(np.concatenate(errors) ** 2, axis=0)))  # K, of sensors over all runs
    worst = [int(i) for i in np.argsort(-rms)[: policy.worst] if rms[i] > sigma]
    pieces = [_piece(sensors[i], i, float(rms[i]), errors, plans, runs).words for i in worst]
    return f"{told}; fits worst: {'; '.join(pieces)}" if pieces else told


def _piece(
    sensor: str, column: int, rms: float, errors: Sequence[np.ndarray], plans: Sequence[Measured], runs: Sequence[Run]
) -> Piece:
    worst, at, hour = 0.0, 0, 0.0
    for k, (error, m) in enumerate(zip(errors, plans, strict=False)):
        hours = ((m.bin_time - m.bin_time[:1]) // 3600.0).astype(int)
        for h in np.unique(hours):
            own = error[hours == h, column]
            square = float(np.nanmean(own**2)) if np.isfinite(own).any() else 0.0
            if square > worst:
                worst, at, hour = square, k, float(h)
    tried = [c for c in candidates(drivers_of(runs)) if c.driver.column != sensor]
    if not tried:
        return Piece(sensor, rms, plans[at].name, hour, None, 0.0)
    F = np.concatenate([responses(run, tried, m.bin_time) for run, m in zip(runs, plans, strict=False)])
    y = np.concatenate([e[:, column] for e in errors])
    good = np.isfinite(y)
    share = (F[good].T @ y[good]) ** 2 / np.maximum((F[good] ** 2).sum(axis=0) * float(y[good] @ y[good]), 1e-30)
    best = int(np.argmax(share))
    return Piece(sensor, rms, plans[at].name, hour, tried[best], float(share[best]))
