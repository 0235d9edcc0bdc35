"""Load signals declared wrongly, judged from the description and not from where a fit has ended.

A current of twice what the log says is four times the heat of a motor, and calibration finds a gain of four. Beside
that fit the right factor explains nothing more. So every factor is given a fit of its own, which begins at the
description, and counts by how much less misfit it leaves than calibration without it.
"""

from __future__ import annotations

import numpy as np

from twin.diagnose.batch import Hypothesis
from twin.diagnose.contest import misfit
from twin.diagnose.fitter import Fitted, bounds
from twin.diagnose.yardstick import Yardstick

CLOSELY = 3  # factors that are looked at again where their parameters are
PASSES = 4


def declared_candidates(yard: Yardstick, y: np.ndarray, fitted: Fitted) -> list[Hypothesis]:
    """Exact factors of signals that leave less misfit than the fit without a cause does."""
    before, found = misfit(yard, fitted), []
    for batch in yard.columns.batches:
        if batch.kind != "signal":
            continue
        D = yard.columns.raw[:, batch.columns[:, 0]].astype(float)
        f, J = yard.fitter.surrogate.at(np.zeros_like(fitted.x))
        projector, white = yard.fitter.projector(J), yard.whiten(y - f)
        left = white[:, None] - D
        order = np.argsort((left * projector(left)).sum(axis=0))
        for i in order[:CLOSELY]:
            statistic = before - _fitted_with(yard, y, D[:, i])
            if statistic > 0.0:
                found.append(Hypothesis(batch, int(i), batch.histories[0], statistic, (1.0,), 0.0))
    return found


def _fitted_with(yard: Yardstick, y: np.ndarray, change: np.ndarray) -> float:
    """The misfit beside a white change (m,) of the outputs, parameters fitted."""
    low, high = bounds(yard.study)
    x, left = np.zeros_like(low), np.inf
    for _ in range(PASSES):
        f, J = yard.fitter.surrogate.at(x)
        projector = yard.fitter.projector(J)
        white = yard.whiten(y - f + J @ x) - change
        left = float(white @ projector(white))
        x = np.clip(projector.most_likely(white)[: len(x)], low, high)
    return left
