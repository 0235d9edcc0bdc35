"""A sensor at fault makes the fit without a cause bend parameters far from where they are: it is judged from the
description all the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose import small_case
from tests.diagnose.test_exact_sizes import clean, noise
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.model.study import Planned
from twin.diagnose.search.exact import exact, misfit, unbent
from twin.diagnose.search.forward import search
from twin.diagnose.search.policy import POLICY
from twin.diagnose.search.start import begun
from twin.diagnose.search.strained import _beside
from twin.diagnose.search.verdict import verdict_of


def read(sensor: str, shown: Callable[[np.ndarray, Planned], np.ndarray]) -> np.ndarray:
    """(m,) measurements of a machine off by half its tolerances, where a sensor shows something else than its place."""
    study = small_case.study()
    (body,) = study.probed.base.bodies
    x = 0.5 * np.random.default_rng(11).standard_normal(len(study.probed.parameters))
    y, first = clean(x) + noise(11), 0
    for k in study.fitted:
        plan = study.runs[k]
        (b, s), _ = plan.shapes
        i = plan.measured.sensors.index(sensor)
        T = study.states(k, x) @ body.C[plan.measured.column[i]]
        y[first : first + b * s].reshape(b, s)[:, i] += plan.measured.mean_of @ (shown(T, plan) - T)
        first += plan.size
    return y


def late(seconds: float) -> Callable[[np.ndarray, Planned], np.ndarray]:
    def shown(T: np.ndarray, _: Planned) -> np.ndarray:
        result, keep = T.copy(), np.exp(-60.0 / seconds)
        for j in range(1, len(T)):
            result[j] = keep * result[j - 1] + (1.0 - keep) * T[j]
        return result

    return shown


def of_the_air(T: np.ndarray, plan: Planned) -> np.ndarray:
    air = np.asarray(plan.run.signals["shop_air"])
    return np.append(air, air[-1])[: len(T)] - small_case.study().probed.base.reference_temperature


@pytest.mark.parametrize(("sensor", "seconds"), [("front", 300.0), ("housing", 900.0), ("screw_middle", 2400.0)])
def test_a_lag_is_compared_by_what_it_explains_at_the_description(sensor, seconds):
    """From where the fit without it ends, lags explained up to a third less than they really do."""
    detector = small_case.made_detector()
    start = begun(detector, y := read(sensor, late(seconds)))
    assert np.abs(start.fitted.x).max() > POLICY.bends
    h = next(h for h in start.glance[1] if (h.name, h.when.name) == (f"sensors.{sensor}", "lag"))
    found = exact(detector, y, start.fitted, h)
    assert found.amplitude[0] == pytest.approx(seconds, rel=0.1)
    assert found.statistic > max(h.statistic, POLICY.covers * (misfit(detector, start.fitted) - len(y)))


@pytest.mark.parametrize("sensor", ["front", "screw_middle"])
def test_beside_a_sensor_that_shows_the_air_no_number_is_out_of_its_tolerance(sensor):
    detector = small_case.made_detector()
    start = begun(detector, y := read(sensor, of_the_air))
    assert start.loose
    h = next(h for h in start.glance[1] if (h.name, h.when.name) == (f"sensors.{sensor}", "detached"))
    there = unbent(detector, y, start.fitted)
    for own in start.loose:
        assert abs(own.x) > POLICY.beyond
        assert abs(_beside(detector, there, own.index, h)) < POLICY.outside
    verdict, (cause,) = verdict_of(search(detector, y, start), FAMILIES)
    assert (verdict, cause.place, cause.history) == ("sensor", f"sensors.{sensor}", "detached")
    assert cause.amplitude == pytest.approx(1.0, abs=0.05)


def test_beside_causes_a_fit_stays_where_it_is():
    detector, y = small_case.made_detector(), read("front", late(2400.0))
    bent = detector.fitter(y)
    assert not unbent(detector, y, bent).x.any()
    beside = replace(bent, more=np.zeros((len(y), 0)))
    assert unbent(detector, y, beside) is beside
