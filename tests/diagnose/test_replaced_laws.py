"""A law of another shape stands in the place of the described one, which has no tolerance beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.evidence.batch import Hypothesis
from twin.diagnose.faults.table import fault_of
from twin.diagnose.search.accepted import Accepted, as_scored, outputs_with, parameter_of, settled, untied_beside
from twin.diagnose.search.refit import refit

SIZE = 60.0  # W at top speed


def shape() -> Accepted:
    """A source with another exponent of its speed."""
    detector = small_case.made_detector()
    batch = next(b for b in detector.columns.batches if fault_of(b).replaces)
    when = max((h for h in batch.histories if h.signal), key=lambda h: h.exponent)
    return as_scored(detector.study, Hypothesis(batch, 0, when, 1e4, (SIZE,)))


def test_what_a_source_emits_as_described_is_free_beside_a_law_of_another_shape():
    """Sources are declared within some per cent; here less than half of what is described is left of this one."""
    detector, one = small_case.made_detector(), shape()
    study = detector.study
    (j,) = untied_beside(study, [one])
    assert j == parameter_of(study, one.hypothesis.name)
    x = np.zeros(len(study.scale))
    x[j] = -8.0
    rng = np.random.default_rng(1)
    y = outputs_with(detector, [one], x)
    y = y + detector.whiten.colour(rng.standard_normal(len(y)))
    found, _ = settled(detector, y, [one])
    assert found[j] == pytest.approx(x[j], abs=1.0)
    guess = replace(one, amplitude=np.array([1.2 * SIZE]))
    fitted, (again,) = refit(detector, y, np.zeros(len(x)), [guess])
    # the exponent of what is described is not known either
    assert again.amplitude[0] == pytest.approx(SIZE, abs=2.0 * np.sqrt(again.covariance[0, 0]))
    assert again.amplitude[0] == pytest.approx(SIZE, rel=0.4)
    assert fitted.x[j] < -3.0


def test_other_causes_leave_tolerances_as_they_are():
    detector = small_case.made_detector()
    heat = next(b for b in detector.columns.batches if b.family == "heat_source")
    one = as_scored(detector.study, Hypothesis(heat, 0, heat.histories[0], 1.0, (5.0,)))
    assert untied_beside(detector.study, [one]) == []
