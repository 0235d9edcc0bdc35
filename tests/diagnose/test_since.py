"""What began with an event, or ends by and by: a loss or a film of one run, a sensor that reads otherwise from an hour
on, a bearing that runs in.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.evidence.nulls import power_of
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.result.diagnosis import Cause, Verdict
from twin.diagnose.search.forward import search
from twin.diagnose.search.verdict import verdict_of

pytestmark = pytest.mark.long


def said(y: np.ndarray, seed: int) -> tuple[Verdict, Cause]:
    """The verdict and the first cause of measurements (m,) without noise."""
    detector, rng = small_case.made_detector(), np.random.default_rng(seed)
    found = search(detector, y + detector.whiten.colour(rng.standard_normal(len(y))))
    verdict, causes = verdict_of(found, FAMILIES)
    return verdict, causes[0]


def nominal() -> np.ndarray:
    study = small_case.study()
    return study.all_outputs(np.zeros(len(study.probed.parameters)))


@pytest.mark.parametrize(
    ("path", "factor", "run"), [("sources.front.gain", 1.8, "run_1"), ("films.air.gain", 2.5, "run_0")]
)
def test_a_number_that_is_another_one_in_one_run_is_that_number_in_that_run(path, factor, run):
    study = small_case.study()
    j = next(i for i, p in enumerate(study.probed.parameters) if p.path == path)
    x = np.zeros(len(study.probed.parameters))
    x[j] = np.log(factor) / study.scale[j]
    y = np.concatenate([study.outputs(k, x if f"run_{k}" == run else np.zeros(len(x))) for k in study.fitted])
    verdict, first = said(y, 1)
    assert verdict in ("named", "ambiguous")
    assert (f"{first.place}.gain", first.unit) == (path, "1")
    assert {w.run for w in first.windows} == {run}
    assert first.amplitude == pytest.approx(factor, rel=0.2)


def test_a_bearing_that_runs_in_is_its_loss():
    """Twice the described friction when new, and over four hours of running, which no column has, ever less of that."""
    study = small_case.study()
    (body,), load = study.probed.base.bodies, study.probed.base.load_model
    j = [source.name for source in load.sources].index("front")
    ran, parts = 0.0, []
    for k in study.fitted:
        slots, q, step = study.slots(k), power_of(study, k, j), study.runs[k].run.step
        hours = (ran + step * np.cumsum(q > 0.01 * q.max())) / 3600.0
        ran = 3600.0 * hours[-1]
        slots.forcing[:, 0] = np.outer(q * np.exp(-hours / 4.0), body.B[:, body.sources.index(j)])
        parts.append(study.outputs(k, np.zeros(len(study.probed.parameters)), slots, (1.0,)))
    verdict, first = said(np.concatenate(parts), 3)
    assert verdict in ("named", "ambiguous")
    assert (first.family, first.place) == ("loss_law", "sources.front")
    assert first.history.startswith("running-in")
    assert first.amplitude == pytest.approx(2.0, abs=0.3)


@pytest.mark.parametrize("start", [0.0, 2.0])
def test_a_sensor_that_reads_otherwise_from_an_hour_on_is_that_sensor(start):
    study = small_case.study()
    y, plan = nominal(), study.runs[1].measured
    T, w = study.runs[1].split(y[study.runs[0].size :])
    T[plan.bin_time >= plan.bin_time[0] + 3600.0 * start, plan.sensors.index("housing")] += 0.9
    y[study.runs[0].size :] = np.concatenate([T.ravel(), w.ravel()])
    verdict, first = said(y, 2)
    assert (verdict, first.family, first.place) == ("sensor", "sensor", "sensors.housing")
    assert first.history.startswith(f"offset from {start:.1f} h")
    assert first.amplitude == pytest.approx(0.9, abs=0.2)
