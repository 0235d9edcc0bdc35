"""Thresholds of a model that fits badly grow with what it leaves."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.diagnose.search.leftovers import _moved, _surrogate, with_leftovers
from twin.diagnose.search.look import Search
from twin.diagnose.search.verdict import limits_at


def test_leftovers_move_without_a_leap_and_keep_their_size():
    values = np.cumsum(np.random.default_rng(0).standard_normal((200, 3)), axis=0)
    steps = np.abs(np.diff(values, axis=0)).max()
    for shift in (0.0, 0.3, 0.77):
        moved = _moved(values, 200, shift)
        assert np.abs(np.diff(moved, axis=0)).max() <= steps + 1e-12
        assert np.isin(moved, values).all()
        assert (moved.std(axis=0) > 0.2 * values.std(axis=0)).all()
    np.testing.assert_allclose(_moved(values, 200, 0.0), values)
    assert _moved(values, 120, 0.4).shape == (120, 3)


def test_gaps_are_bridged_and_channels_go_together():
    left = [(np.column_stack([np.arange(50.0), -np.arange(50.0)]), np.zeros((0, 3))) for _ in range(2)]
    left[0][0][10:20, 0] = np.nan
    for made in _surrogate(left, np.random.default_rng(1)):
        both = made.reshape(50, 2)
        assert np.isfinite(both).all()
        np.testing.assert_allclose(both[:, 0], -both[:, 1], atol=1.0)


@pytest.mark.long
def test_thresholds_and_limits_grow_and_never_shrink():
    detector = small_case.made_detector()
    study = detector.study
    n = len(study.scale)
    exact = np.concatenate([study.outputs(k, np.zeros(n)) for k in study.fitted])
    rng = np.random.default_rng(3)

    def found(size: float) -> tuple[Search, np.ndarray]:
        """The machine as described, with slow leftovers of so many kelvins beside noise."""
        parts, first = [], 0
        for k in study.fitted:
            T, w = study.runs[k].split(exact[first : first + study.runs[k].size])
            first += study.runs[k].size
            slow = np.sin(np.linspace(0.0, 5.0, len(T)))[:, None] * rng.uniform(-1.0, 1.0, T.shape[1])
            parts += [(T + size * slow + 0.02 * rng.standard_normal(T.shape)).ravel(), w.ravel()]
        y = np.concatenate(parts)
        x = np.zeros(n)
        return Search(detector, x, x, (), (), y, y, detector.columns.heat, np.eye(n)), y

    small, large = (with_leftovers(detector, *found(size)) for size in (0.01, 2.0))
    for name, value in detector.thresholds.items():
        assert small.thresholds[name] >= value
        assert large.thresholds[name] >= value
    assert large.thresholds["heat_source"] > 3.0 * small.thresholds["heat_source"]
    before, after = limits_at(small), limits_at(large)
    assert all(after[key] >= before[key] for key in before)
    assert np.all(large.pulls.settled.sigma >= detector.pulls.settled.sigma)
