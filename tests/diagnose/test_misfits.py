"""What a cause leaves is no second one; what comes and goes too often has no name; a number that something else seen
explains better is not out of its tolerance."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose import small_case
from tests.diagnose.test_search import measured
from twin.diagnose.accepted import Accepted
from twin.diagnose.acted import units_of
from twin.diagnose.batch import Hypothesis
from twin.diagnose.catalogue import FAMILIES
from twin.diagnose.diagnosis import Window
from twin.diagnose.search import DRIES, FEW, LEAVES, LEFT, _leaking, _restless, search
from twin.diagnose.search_declared import declared_candidates
from twin.diagnose.search_look import look
from twin.diagnose.search_strained import LATER, closed, strained
from twin.diagnose.settled import settled
from twin.diagnose.verdict import verdict_of


def in_windows(n: int) -> Accepted:
    """Heat that comes and goes n times."""
    yard = small_case.yardstick()
    batch = next(b for b in yard.columns.batches if b.kind == "heat" and b.family == "heat_source")
    at = next(k for k, when in enumerate(batch.histories) if when.windows)
    windows = tuple(Window("run_0", 3600.0 * k, 3600.0 * k + 1800.0) for k in range(n))
    h = Hypothesis(batch, 0, replace(batch.histories[at], windows=windows), 100.0, (10.0,), 1.0)
    return Accepted(h, units_of(yard.study, h), np.array([10.0]), np.eye(1), 100.0, 36.0, ())


@pytest.mark.parametrize(("windows", "left", "restless"), [(FEW + 1, 1.1, 1), (FEW + 1, 0.9, 0), (FEW, 5.0, 0)])
def test_what_comes_and_goes_often_must_leave_nothing_anywhere(windows, left, restless):
    yard = small_case.yardstick()
    accepted = [in_windows(windows)]
    assert len(_restless(yard, accepted, {"elsewhere": left * yard.thresholds["unknown"]})) == restless
    strong = [replace(accepted[0], statistic=5.1 / LEAVES * yard.thresholds["unknown"])]  # whose misfits they may be
    assert not _restless(yard, strong, {"elsewhere": left * yard.thresholds["unknown"]})


@pytest.mark.parametrize(
    ("statistic", "left", "leaking"),
    [
        (100.0, 1.1 * LEFT * 36.0, 1),
        (100.0, 0.9 * LEFT * 36.0, 0),
        (1e5, 1.1 * LEAVES * 1e5, 1),
        (1e5, 0.9 * LEAVES * 1e5, 0),
    ],
)
def test_one_window_may_leave_no_heat_but_a_strong_ones_misfits(statistic, left, leaking):
    yard = small_case.yardstick()
    yard = replace(yard, thresholds={**yard.thresholds, "unknown": 36.0})
    one = replace(in_windows(1), statistic=statistic)
    assert len(_leaking(yard, [one], {"elsewhere": left})) == leaking
    batch = replace(one.hypothesis.batch, kind="coolant")
    wet = replace(one, hypothesis=replace(one.hypothesis, batch=batch))
    assert len(_leaking(yard, [wet], {"elsewhere": left * (DRIES / LEAVES if statistic > 1e4 else 1.0)})) == leaking
    always = replace(one, hypothesis=replace(one.hypothesis, when=replace(one.hypothesis.when, windows=())))
    assert not _leaking(yard, [always], {"elsewhere": left})


@pytest.mark.parametrize("leave", [True, False])
@pytest.mark.parametrize(("watts", "levels"), [(60.0, (0.0, 1.0, 0.3, 0.3)), (300.0, (0.0, 1.0, 0.3, 0.3))])
def test_heat_that_goes_down_by_steps_is_no_window(watts, levels, leave, monkeypatch):
    """It is named as one only where windows may leave what they like."""
    if leave:
        monkeypatch.setattr(sys.modules[search.__module__], "LEFT", 1e9)
    found = search(small_case.yardstick(), measured("heat", "housing", watts, 3, levels))
    assert bool(found.accepted) == leave
    assert (verdict_of(found, FAMILIES)[0] == "unknown") != leave


def test_a_second_cause_explains_more_than_the_first_ones_misfits(monkeypatch):
    study, y = small_case.study(), measured("heat", "housing", 300.0, seed=3)
    first = 0
    for k in study.fitted:
        (b, s), _ = study.runs[k].shapes
        y[first : first + b * s].reshape(b, s)[:, 1] += study.runs[k].measured.bin_time * 3.0 / 14400.0
        first += study.runs[k].size
    heat, sensor = search(small_case.yardstick(), y).accepted
    assert (heat.hypothesis.family, sensor.hypothesis.family) == ("heat_source", "sensor")
    monkeypatch.setattr(sys.modules[search.__module__], "MISFIT", 1.5 * sensor.statistic / heat.statistic)
    (alone,) = search(small_case.yardstick(), y).accepted
    assert alone.hypothesis.family == "heat_source"


@pytest.mark.parametrize("stays", [True, False])
def test_a_number_is_not_out_of_tolerance_where_something_seen_explains_more(stays, monkeypatch):
    """Also where that is too weak to be named beside another cause."""
    yard = small_case.yardstick()
    study = yard.study
    x = np.zeros(len(study.bench.parameters))
    x[next(i for i, p in enumerate(study.bench.parameters) if p.kind == "source")] = 4.5
    y = np.concatenate([study.outputs(k, x) for k in study.fitted])
    fitted = yard.fitter(y)
    x0, covariance = settled(yard, y, ())
    declared = declared_candidates(yard, y, fitted)
    seen, ranked, step = look(yard, fitted, declared)
    relaxed = strained(yard, y, fitted, x0, covariance, look(yard, fitted))
    assert relaxed is not None
    module = sys.modules[closed.__module__]
    monkeypatch.setattr(module, "misfit", lambda *_: 0.0)  # the number itself removes nothing of what was left
    monkeypatch.setattr(module, "_stays", lambda *_: stays)
    other = next(h for h in ranked if h.family not in ("loss_law", "signal"))
    alarm = replace(other, statistic=0.5 * (1.0 + LATER) * yard.thresholds[other.family])
    ended = closed(yard, y, fitted, declared, (seen, [alarm], step), relaxed, x0)
    assert (ended is not None) == stays
    quiet = replace(other, statistic=0.9 * yard.thresholds[other.family])
    assert closed(yard, y, fitted, declared, (seen, [quiet], step), relaxed, x0) is not None
