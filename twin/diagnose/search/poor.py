"""A model too poor to diagnose (`twin.diagnose.search.dispersion`): where it fits worst, when, and which body that
follows one logged column with one lag resembles most what is left there.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.calibrate.fit.measured import Measured
from twin.calibrate.members.driver import drivers_of
from twin.calibrate.members.responses import candidates, responses
from twin.diagnose.result.numbers import rms
from twin.diagnose.search.dispersion import Dispersion
from twin.diagnose.search.gain import predicted
from twin.diagnose.search.look import Search
from twin.logs.run import Run


def poor_note(
    found: Search, plans: Sequence[Measured], runs: Sequence[Run], sigma: float, dispersion: Dispersion
) -> str:
    """In words, with the sensors that fit worst and what would help there; sigma [K] of one reading."""
    policy = found.detector.policy
    variance = f"{dispersion.share:.2g} times the variance of noise and model discrepancy"
    if dispersion.share > policy.dispersed:
        told = (
            f"the model is too poor: the residual of the best explanation has {variance}, and a cause must explain "
            f"{policy.excess:.0%} of what slow errors of single channels do not"
        )
    else:
        told = f"the best explanation still has {variance}: a cause must explain {policy.excess:.0%} of the excess"
    sensors = plans[0].sensors
    if not sensors or any(m.sensors != sensors for m in plans[: len(runs)]):
        return told
    errors = []
    for k, m in enumerate(plans[: len(runs)]):
        flat = predicted(found, k).extended
        errors.append(m.temperature - found.detector.study.runs[k].split(flat)[0])
    left = np.nan_to_num(rms(np.concatenate(errors)))  # K, of sensors over all runs
    worst = [int(i) for i in np.argsort(-left)[: policy.worst] if left[i] > sigma]
    words = [f"{sensors[i]} {left[i]:.2g} K {_at_worst(i, errors, plans, runs)}" for i in worst]
    return f"{told}; fits worst: {'; '.join(words)}" if words else told


def _at_worst(column: int, errors: Sequence[np.ndarray], plans: Sequence[Measured], runs: Sequence[Run]) -> str:
    """The worst hour of a sensor, from errors (b, s) [K] of every run, and what would help there, in words."""
    worst, at, hour = 0.0, 0, 0.0
    for k, (error, m) in enumerate(zip(errors, plans, strict=False)):
        hours = ((m.bin_time - m.bin_time[:1]) // 3600.0).astype(int)
        for h in np.unique(hours):
            own = error[hours == h, column]
            square = float(np.nanmean(own**2)) if np.isfinite(own).any() else 0.0
            if square > worst:
                worst, at, hour = square, k, float(h)
    when = f"(worst from {hour:.0f} h of {plans[at].name})"
    tried = [c for c in candidates(drivers_of(runs)) if c.driver.column != plans[0].sensors[column]]
    if not tried:
        return when
    F = np.concatenate([responses(run, tried, m.bin_time) for run, m in zip(runs, plans, strict=False)])
    y = np.concatenate([e[:, column] for e in errors])
    good = np.isfinite(y)
    share = (F[good].T @ y[good]) ** 2 / np.maximum((F[good] ** 2).sum(axis=0) * float(y[good] @ y[good]), 1e-30)
    best = int(np.argmax(share))
    return f"{when}: a body that {tried[best].words} would explain {share[best]:.0%} of it"
