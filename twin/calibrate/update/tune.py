"""How far the model may be off where no parameter explains it: what earlier data say.

The prior of `StatePrior` is cautious: a machine is not its mesh. On a run that was measured before, each of a few
multiples of it predicts every TCP measurement before using it; the likelihood of those innovations tells which fits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.calibrate.update.files import AXES
from twin.calibrate.update.methods import Options, update_run
from twin.calibrate.update.program import Updated
from twin.calibrate.update.state_filter import StatePrior
from twin.logs.run import Run
from twin.progress import Progress, silent
from twin.rom.artefact import Artefact
from twin.run.replay import replay

FACTORS = (1.0, 0.3, 0.1)


@dataclass(frozen=True)
class Tuned:
    """The multiple that earlier runs are most likely under."""

    factor: float
    options: Options
    log_likelihood: tuple[tuple[float, float], ...]  # (factor, sum over all TCP innovations)


def scaled(prior: StatePrior, factor: float) -> StatePrior:
    """The prior with sensor biases, TCP offset and TCP gain times `factor`."""
    return replace(
        prior,
        sensor_bias=factor * prior.sensor_bias,
        tcp_offset=factor * prior.tcp_offset,
        tcp_gain=factor * prior.tcp_gain,
    )


def log_likelihood(updated: Updated) -> float:
    """Of all TCP innovations of a run, component by component, in um; rejected ones count as at the gate."""
    told = [t for t in updated.told if t.name in AXES]
    ratio = np.array([t.innovation / t.sigma for t in told])
    return float(-0.5 * np.sum(np.clip(ratio**2, 0.0, 16.0)) - np.sum(np.log([1e6 * t.sigma for t in told])))


def tune(
    artefact: Artefact,
    earlier: Sequence[Run],
    options: Options = Options(),
    factors: Sequence[float] = FACTORS,
    progress: Progress = silent,
) -> Tuned:
    """The options with the most likely multiple of the prior. Raises what `update_run` raises."""
    total = dict.fromkeys(factors, 0.0)
    for run in earlier:
        base = replay(artefact, run, options.dt, options.substeps)
        for factor in factors:
            tried = replace(options, method="state", state=scaled(options.state, factor))
            total[factor] += log_likelihood(update_run(artefact, run, tried, None, progress, base)[0])
    best = max(total, key=lambda f: total[f])
    return Tuned(best, replace(options, state=scaled(options.state, best)), tuple(total.items()))
