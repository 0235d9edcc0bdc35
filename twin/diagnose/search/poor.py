"""A model too poor to diagnose: what its best fit leaves is far above noise at most sensors, so it is form.

Then a cause that fits is a cause among many, and none is named. The useful answer is where the model fits worst, when,
and which piece would help first: of all bodies that follow one logged column with one lag, the one that resembles most
what is left there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.calibrate.fit.measured import Measured
from twin.calibrate.members.driver import drivers_of
from twin.calibrate.members.responses import Candidate, candidates, responses
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


@dataclass(frozen=True)
class Poor:
    """How poor a model is."""

    median: float  # over sensors: rms that is left, in standard deviations of one reading
    pieces: tuple[Piece, ...]

    @property
    def note(self) -> str:
        told = []
        for p in self.pieces:
            help_ = "" if p.by is None else f": a body that {p.by.words} would explain {p.share:.0%} of it"
            told.append(f"{p.sensor} {p.rms:.2g} K (worst from {p.hour:.0f} h of {p.run}){help_}")
        left = f"at half of its sensors it leaves {self.median:.0f} times the noise of a reading, or more"
        return f"the model is too poor to name a cause: {left}; fits worst: {'; '.join(told)}"


def too_poor(found: Search, plans: Sequence[Measured], runs: Sequence[Run], sigma: float) -> Poor | None:
    """None where half of the sensors are left with less than policy.poor sigma [K], or causes explain most of it."""
    policy = found.detector.policy
    sensors = plans[0].sensors
    if len(sensors) < policy.sensors or any(m.sensors != sensors for m in plans[: len(runs)]):
        return None
    before: list[np.ndarray] = []
    errors: list[np.ndarray] = []
    for k, m in enumerate(plans[: len(runs)]):
        models = predicted(found, k)
        for into, flat in ((before, models.recalibrated), (errors, models.extended)):
            into.append(m.temperature - found.detector.study.runs[k].split(flat)[0])
    rms = _rms(errors)
    median = float(np.nanmedian(rms)) / sigma
    explained = bool(np.nanmedian(rms) < policy.relieves * np.nanmedian(_rms(before)))
    if explained or not median > policy.poor:
        return None
    order = np.argsort(-np.nan_to_num(rms))[: policy.worst]
    return Poor(median, tuple(_piece(sensors[i], int(i), float(rms[i]), errors, plans, runs) for i in order))


def _rms(errors: Sequence[np.ndarray]) -> np.ndarray:
    """(s,) K over all runs."""
    return np.asarray(np.sqrt(np.nanmean(np.concatenate(errors) ** 2, axis=0)))


def _piece(
    sensor: str, column: int, rms: float, errors: Sequence[np.ndarray], plans: Sequence[Measured], runs: Sequence[Run]
) -> Piece:
    worst, at, hour = 0.0, 0, 0.0
    for k, (error, m) in enumerate(zip(errors, plans, strict=False)):
        hours = ((m.bin_time - m.bin_time[0]) // 3600.0).astype(int) if len(m.bin_time) else np.zeros(0, dtype=int)
        for h in np.unique(hours):
            square = (
                float(np.nanmean(error[hours == h, column] ** 2))
                if np.isfinite(error[hours == h, column]).any()
                else 0.0
            )
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
