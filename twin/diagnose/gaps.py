"""A yardstick for measurements with gaps that its own do not have: what is missing counts nowhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.calibrate.fit.measured import Measured
from twin.diagnose.sight import Columns
from twin.diagnose.study import with_measured
from twin.diagnose.whiten import missing
from twin.diagnose.yardstick import Yardstick


def emptied(yard: Yardstick, plans: list[Measured]) -> Yardstick:
    """The yardstick where these measurements have gaps that its own do not have; thresholds stay as they are.

    `twin diagnose` makes a new one, thresholds and all, which takes minutes: too expensive for every such trial of a
    campaign.
    """
    study = with_measured(yard.study, plans)
    kept = ~missing(study)
    others = np.where(kept[:, None], yard.fitter.others, 0.0)
    raw = np.where(kept[:, None], yard.columns.raw, np.float32(0.0))
    fitter = replace(yard.fitter, study=study, whiten=replace(yard.whiten, study=study), others=others)
    columns = Columns.of(raw, yard.columns.batches, yard.columns.heat, others)
    lost = replace(yard.lost, responses=np.where(kept[:, None], yard.lost.responses, 0.0))
    return replace(yard, study=study, fitter=fitter, columns=columns, lost=lost)
