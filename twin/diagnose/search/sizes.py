"""Plays, clocks and lags at several sizes: their responses change in shape with their size, not in height.

A wide play holds the tool nearly still and a narrow one lags a little behind every turn; a clock that is an hour off
shows another hour's heating, not sixty times that of a minute; a sensor that follows in an hour shows no cycle at all.
The bank of columns knows one size of each; here the others are scored when they are looked for.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.linalg

from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.evidence.whiten import Projector
from twin.diagnose.faults.table import fault_of
from twin.diagnose.search.accepted import curved_change
from twin.diagnose.search.detector import Detector


def sized_candidates(detector: Detector, projector: Projector, white: np.ndarray) -> list[Hypothesis]:
    """Plays of TCP components, clocks of runs and lags of sensors that would explain white residuals (m,)."""
    tried = [
        Hypothesis(batch, i, batch.histories[0], 0.0, (size,), 0.0)
        for batch in detector.columns.batches
        for sizes in [fault_of(batch).sizes]
        for i in range(len(batch.places) if sizes else 0)
        for size in sizes
    ]
    if not tried:
        return []
    D = detector.whiten(np.column_stack([curved_change(detector, h, h.amplitude[0], None) for h in tried]))
    # all at once: N is large, and would be read twice for each of them
    B = projector.N.T @ np.column_stack([D, white])
    half = scipy.linalg.solve_triangular(projector.factor[0], B, lower=True)
    explained = white @ D - half[:, -1] @ half[:, :-1]  # D^T Pi r
    own = (D**2).sum(axis=0) - (half[:, :-1] ** 2).sum(axis=0)  # D^T Pi D
    return [
        replace(h, statistic=float(2.0 * g - F), information=float(F) / h.amplitude[0] ** 2)
        for h, g, F in zip(tried, explained, own, strict=True)
        if 2.0 * g > F
    ]
