"""Where all other channels refute one, the model is asked, too: what it explains as it was measured is no fault."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.calibrate.channels.finding import Finding
from twin.calibrate.channels.judge import Judgement, set_aside
from twin.calibrate.fit.measured import Measured, measured
from twin.diagnose.search.detector import emptied
from twin.diagnose.search.witness import upheld
from twin.logs.run import Run

DRIFT, SURE, UNSURE = 2.0, 0.3, 1.0  # K, and half of the intervals of what is corrected and of what is set aside


def as_measured(drift: float) -> tuple[list[Run], str]:
    """The two fitted runs as the model has them, with noise; the first sensor drifts [K] through the first one."""
    study, rng, made = small_case.study(), np.random.default_rng(5), []
    name = study.runs[0].measured.sensors[0]
    for k, run in enumerate(small_case.runs()[:2]):
        planned, table = study.runs[k], run.temperatures
        T, _ = planned.split(study.outputs(k, np.zeros(len(study.probed.parameters))))
        time = table.time
        columns = {
            s: np.interp(time, planned.measured.bin_time, T[:, i]) + small_case.NOISE * rng.standard_normal(len(time))
            for i, s in enumerate(planned.measured.sensors)
        }
        if k == 0:
            columns[name] = columns[name] + drift * time / time[-1]
        made.append(replace(run, temperatures=replace(table, columns=columns)))
    return made, name


def plans_of(runs: list[Run]) -> list[Measured]:
    study = small_case.study()
    return [measured(study.probed.base, run, p.run.drive, p.run.name) for run, p in zip(runs, study.runs, strict=True)]


@pytest.mark.parametrize("half", [SURE, UNSURE])
@pytest.mark.parametrize("drift", [0.0, DRIFT])
def test_a_drift_that_the_model_explains_as_it_is_is_none(drift: float, half: float):
    runs, name = as_measured(drift)
    end = float(runs[0].temperatures.time[-1])
    told = Finding("drift", (name,), (0,), 0.0, end, DRIFT, (DRIFT - half, DRIFT + half), 80.0, 70.0)
    noise = replace(told, what="noise", runs=(1,), end=600.0, statistic=np.inf)  # by rows of the run itself
    judgement = Judgement((told, noise), (), ())
    plans = plans_of([*set_aside(runs, judgement.findings), *small_case.runs()[2:]])
    detector = emptied(small_case.made_detector(), plans)
    own, left, kept = upheld(detector, plans, runs, judgement)
    refuted = drift == 0.0 and half == SURE  # of readings that were taken out nothing is asked
    assert kept.findings == ((noise,) if refuted else judgement.findings)
    column = plans[0].sensors.index(name)
    before, after, raw = (p[0].temperature[:, column] for p in (plans, left, plans_of([*runs, *small_case.runs()[2:]])))
    assert np.isfinite(before).any() == (half == SURE)  # else no reading of that run is kept
    known = np.isfinite(before)
    np.testing.assert_allclose(after[known], raw[known] if refuted else before[known])
    assert not np.isfinite(after[~known]).any()
    if refuted:
        np.testing.assert_array_equal(own.study.runs[0].measured.temperature, left[0].temperature)
