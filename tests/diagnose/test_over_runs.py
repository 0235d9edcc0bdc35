"""Runs are stepped side by side, and nothing else changes."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.model.over_runs import over_runs
from twin.diagnose.model.surrogate import jacobian_of


@pytest.mark.parametrize(("workers", "together"), [("1", 1), ("2", 2)])
def test_runs_meet_where_two_may_work_at_once(workers, together, monkeypatch):
    monkeypatch.setenv("TWIN_WORKERS", workers)
    meeting = threading.Barrier(together)

    def one(k: int) -> int:
        meeting.wait(timeout=60.0)
        return 10 * k

    assert over_runs(one, [3, 1]) == [30, 10]


def test_what_a_run_raises_is_raised(monkeypatch):
    monkeypatch.setenv("TWIN_WORKERS", "2")
    with pytest.raises(ZeroDivisionError):
        over_runs(lambda k: 1 // k, [1, 0])


def test_digits_are_those_of_one_run_after_the_other(monkeypatch):
    study = small_case.study()
    x = 0.3 * np.random.default_rng(1).standard_normal(len(study.probed.parameters))
    found = []
    for workers in ("1", "2"):
        monkeypatch.setenv("TWIN_WORKERS", workers)
        found.append((study.all_outputs(x), jacobian_of(study, x)))
    for one, other in zip(*found, strict=True):
        np.testing.assert_array_equal(one, other)
