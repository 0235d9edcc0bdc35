"""Thresholds of a model that fits badly grow with what it leaves."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.search.leftovers import leftovers, surrogate, with_leftovers
from twin.diagnose.search.look import Search
from twin.diagnose.search.verdict import limits_at


def test_leftovers_change_place_and_sign_alike_in_all_runs():
    rng = np.random.default_rng(0)
    first = rng.standard_normal((40, 4)), rng.standard_normal((6, 3))
    runs = [first, (2.0 * first[0][:30], first[1][:5])]
    made = surrogate(runs, np.random.default_rng(1))
    assert len(made) == 40 * 4 + 6 * 3 + 30 * 4 + 5 * 3
    T, w = made[:160].reshape(40, 4), made[160:178].reshape(6, 3)
    again = made[178:298].reshape(30, 4)
    np.testing.assert_allclose(again, 2.0 * T[:30])
    np.testing.assert_allclose(np.sort((T**2).sum(axis=0)), np.sort((first[0] ** 2).sum(axis=0)))
    np.testing.assert_allclose(np.abs(w), np.abs(first[1]))
    others = [surrogate(runs, np.random.default_rng(seed)) for seed in range(2, 8)]
    assert not any(np.allclose(made, other) for other in others)


@pytest.mark.long
def test_thresholds_and_limits_grow_and_never_shrink():
    detector = small_case.made_detector()
    study = detector.study
    n = len(study.scale)
    exact = np.concatenate([study.outputs(k, np.zeros(n)) for k in study.fitted])
    rng = np.random.default_rng(3)

    def raised(size: float):
        """For the machine as described, with slow leftovers of so many kelvins beside noise."""
        parts, first = [], 0
        for k in study.fitted:
            T, w = study.runs[k].split(exact[first : first + study.runs[k].size])
            first += study.runs[k].size
            slow = np.sin(np.linspace(0.0, 25.0, len(T)))[:, None] * rng.uniform(0.5, 1.0, T.shape[1])
            parts += [(T + size * slow + 0.02 * rng.standard_normal(T.shape)).ravel(), w.ravel()]
        y = np.concatenate(parts)
        found = Search(detector, np.zeros(n), np.zeros(n), (), (), y, y, detector.columns.heat, np.eye(n))
        left = leftovers(detector, found, y)
        return with_leftovers(detector, left), np.median(left.by_sensor(detector))

    (small, noise), (large, form) = raised(0.0), raised(2.0)
    assert noise < 1.5 < form
    for name, value in detector.thresholds.items():
        assert small.thresholds[name] >= value
        assert large.thresholds[name] >= value
    assert large.thresholds["heat_source"] > 3.0 * small.thresholds["heat_source"]
    before, after = limits_at(small), limits_at(large)
    assert all(after[key] >= before[key] for key in before)
    assert not np.any(large.pulls.strain(np.full(n, 9.0), np.full(n, 9.0)))
