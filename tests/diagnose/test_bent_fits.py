"""A sensor at fault makes the fit without a cause bend parameters far from where they are: it is judged from the
description all the same.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose import small_case
from tests.diagnose.test_exact_sizes import following, read
from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.model.study import Planned
from twin.diagnose.search.exact import exact, misfit, unbent
from twin.diagnose.search.forward import search
from twin.diagnose.search.policy import POLICY
from twin.diagnose.search.start import begun
from twin.diagnose.search.strained import beside
from twin.diagnose.search.verdict import verdict_of


def of_the_air(T: np.ndarray, plan: Planned) -> np.ndarray:
    air = np.asarray(plan.run.signals["shop_air"])
    return np.append(air, air[-1])[: len(T)] - small_case.study().probed.base.reference_temperature


@pytest.mark.parametrize(("sensor", "seconds"), [("front", 300.0), ("housing", 900.0), ("screw_middle", 2400.0)])
def test_a_lag_is_compared_by_what_it_explains_at_the_description(sensor, seconds):
    """From where the fit without it ends, lags explained up to a third less than they really do."""
    detector = small_case.made_detector()
    start = begun(detector, y := read(sensor, following(seconds)))
    assert np.abs(start.fitted.x).max() > POLICY.bends
    h = next(h for h in start.glance[1] if (h.name, h.when.name) == (f"sensors.{sensor}", "lag"))
    found = exact(detector, y, start.fitted, h)
    assert found.amplitude[0] == pytest.approx(seconds, rel=0.1)
    assert found.statistic > max(h.statistic, POLICY.covers * (misfit(detector, start.fitted) - len(y)))


@pytest.mark.parametrize("sensor", ["front", "screw_middle"])
def test_beside_a_sensor_that_shows_the_air_no_number_is_far_from_its_declared_value(sensor):
    detector = small_case.made_detector()
    start = begun(detector, y := read(sensor, of_the_air))
    assert start.loose
    h = next(h for h in start.glance[1] if (h.name, h.when.name) == (f"sensors.{sensor}", "detached"))
    there = unbent(detector, y, start.fitted)
    for own in start.loose:
        assert abs(own.x) > POLICY.beyond
        assert abs(beside(detector, there, own.index, h)) < 0.5 * POLICY.beyond
    verdict, (cause,) = verdict_of(search(detector, y, start), FAMILIES)
    assert (verdict, cause.place, cause.history) == ("sensor", f"sensors.{sensor}", "detached")
    assert cause.amplitude == pytest.approx(1.0, abs=0.05)


def test_beside_causes_a_fit_stays_where_it_is():
    detector, y = small_case.made_detector(), read("front", following(2400.0))
    bent = detector.fitter(y)
    assert not unbent(detector, y, bent).x.any()
    beside = replace(bent, more=np.zeros((len(y), 0)))
    assert unbent(detector, y, beside) is beside
