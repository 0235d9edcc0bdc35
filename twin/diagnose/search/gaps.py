"""A detector for measurements with gaps that its own do not have: what is missing counts nowhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.calibrate.fit.measured import Measured
from twin.diagnose.evidence.sight import Columns
from twin.diagnose.evidence.whiten import missing
from twin.diagnose.model.study import with_measured
from twin.diagnose.search.detector import Detector


def emptied(detector: Detector, plans: list[Measured]) -> Detector:
    """The detector where these measurements have gaps that its own do not have, itself where there is none; thresholds
    stay as they are.

    `twin diagnose` makes a new one, thresholds and all, which takes minutes: too expensive for every such trial of a
    campaign.
    """
    study = with_measured(detector.study, plans)
    kept = ~missing(study)
    if not np.any(~kept & ~missing(detector.study)):
        return detector
    others = np.where(kept[:, None], detector.fitter.others, 0.0)
    raw = np.where(kept[:, None], detector.columns.raw, np.float32(0.0))
    fitter = replace(detector.fitter, study=study, whiten=replace(detector.whiten, study=study), others=others)
    columns = Columns.of(raw, detector.columns.batches, detector.columns.heat, others)
    lost = replace(detector.lost, responses=np.where(kept[:, None], detector.lost.responses, 0.0))
    return replace(detector, study=study, fitter=fitter, columns=columns, lost=lost)
