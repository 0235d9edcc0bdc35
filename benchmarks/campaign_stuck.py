"""Trials with a stuck sensor: emptied as `twin diagnose` does it, judged by the campaign's one yardstick."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.hidden_draw import Trial
from twin.calibrate.fit.measured import Measured
from twin.diagnose.channels_check import stuck_sensors
from twin.diagnose.diagnosis import Cause
from twin.diagnose.sight import Columns
from twin.diagnose.study import with_measured
from twin.diagnose.whiten import missing
from twin.diagnose.yardstick import Yardstick


def without_stuck(yard: Yardstick, trial: Trial) -> tuple[Trial, list[Cause]]:
    """The trial with frozen stretches of the fitted runs emptied, and a cause for each."""
    names = [planned.run.name for planned in yard.study.runs[:2]]
    usable, causes = stuck_sensors(trial.runs[:2], yard.study.bench.base.sensors, names)
    return (replace(trial, runs=(*usable, *trial.runs[2:])), causes) if causes else (trial, [])


def emptied(yard: Yardstick, plans: list[Measured]) -> Yardstick:
    """The yardstick where these measurements have gaps that its own do not have; thresholds stay as they are.

    A command makes a new one, thresholds and all, which takes a campaign's minutes for every such trial.
    """
    study = with_measured(yard.study, plans)
    kept = ~missing(study)
    others = np.where(kept[:, None], yard.fitter.others, 0.0)
    raw = np.where(kept[:, None], yard.columns.raw, np.float32(0.0))
    fitter = replace(yard.fitter, study=study, whiten=replace(yard.whiten, study=study), others=others)
    columns = Columns.of(raw, yard.columns.batches, yard.columns.heat, others)
    lost = replace(yard.lost, responses=np.where(kept[:, None], yard.lost.responses, 0.0))
    return replace(yard, study=study, fitter=fitter, columns=columns, lost=lost)
