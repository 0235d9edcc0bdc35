"""The bounded gain-and-offset filter: planted values, zero crossings, bounds, gates, and calibrated uncertainty."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from twin.calibrate.update import gain_filter
from twin.calibrate.update.gain_filter import GainPrior, GainState
from twin.calibrate.update.series import replay_online, replay_online_003

HOUR = 3600.0
PRIOR = GainPrior()


def learn(prior, series, noise=1e-6):
    """The state after (time, s, L s, measured) rows of one axis, and the predictions made before each."""
    state, before = gain_filter.begin(prior, 0.0, 1), []
    for time, s, slow, measured in series:
        state = gain_filter.wait(prior, state, time)
        parts = np.array([[s, slow]])
        before.append([v[0] for v in gain_filter.predict(prior, state, parts)])
        state, _ = gain_filter.assimilate(prior, state, parts, np.array([measured]), noise)
    return state, np.array(before)


def test_recovers_a_planted_gain_and_offset():
    rng = np.random.default_rng(0)
    time = 1800.0 * np.arange(1, 61)
    s = 40e-6 * np.sin(time / 7000.0)
    measured = 0.8 * s + 3e-6 + 0.3e-6 * rng.standard_normal(len(s))
    state, before = learn(PRIOR, zip(time, s, np.zeros(60), measured, strict=True), 0.3e-6)
    gain, _, offset = state.weight[:, 0] @ state.mean[:, 0]
    assert gain == pytest.approx(0.8, abs=0.03)
    assert offset == pytest.approx(3e-6, abs=0.6e-6)
    late = before[20:, 0] - 0.8 * s[20:] - 3e-6
    assert np.sqrt(np.mean(late**2)) < 0.4e-6


def test_a_zero_crossing_breaks_the_papers_gain_and_not_the_filter():
    """Erratum E-003-5: the simulated error goes through zero while the true one is offset by 2 um."""
    rng = np.random.default_rng(1)
    time = 1800.0 * np.arange(1, 25)
    s = 20e-6 * np.cos(time / (24 * 1800.0) * 2.0 * np.pi + 0.26)
    truth = 0.9 * s + 2e-6
    measured = truth + 0.5e-6 * rng.standard_normal(len(s))
    assert np.abs(s).min() < 0.1e-6
    paper = replay_online_003(time, s, measured, 1800.0)
    ours = replay_online(PRIOR, time, s, measured, 0.5e-6, 1800.0)
    assert np.abs(paper.predicted - truth).max() > 100e-6
    assert np.abs(ours.predicted - truth)[4:].max() < 3e-6
    assert np.abs(ours.predicted - truth).max() < 6e-6


def test_in_the_dead_zone_only_the_offset_learns():
    state = gain_filter.begin(PRIOR, 0.0, 1)
    small = np.array([[2.9e-6, 2.9e-6]])
    after, _ = gain_filter.assimilate(PRIOR, state, small, np.array([6e-6]), 1e-6)
    np.testing.assert_array_equal(after.mean[:, 0, :2], state.mean[:, 0, :2])
    assert np.all(after.mean[:, 0, 2] > 0.0)
    large, _ = gain_filter.assimilate(PRIOR, state, np.array([[3.1e-6, 0.0]]), np.array([6e-6]), 1e-6)
    assert np.all(large.mean[:, 0, 0] > 1.0)


@given(
    st.lists(
        st.tuples(st.floats(0.0, 1e5), st.floats(-1e-3, 1e-3), st.floats(-1e-3, 1e-3), st.floats(-1.0, 1.0)),
        min_size=1,
        max_size=20,
    )
)
def test_whatever_is_measured_gains_stay_in_their_bounds_and_variances_positive(rows):
    state, before = learn(PRIOR, rows)
    assert np.all(state.mean >= np.array(PRIOR.low) - 1e-12)
    assert np.all(state.mean <= np.array(PRIOR.high) + 1e-12)
    assert np.all(np.isfinite(before))
    assert np.all(before[:, 1] > 0.0)
    scaled = state.covariance[:, 0] / np.outer(PRIOR.sigma, PRIOR.sigma)
    assert np.linalg.eigvalsh(scaled).min() >= -1e-9 * np.abs(scaled).max()
    assert np.abs(scaled).max() < 1e4  # bounded by 16 priors and 20 days of walking
    assert state.weight.sum() == pytest.approx(1.0)


def settled():
    s = np.full(10, 30e-6)
    state, _ = learn(PRIOR, zip(600.0 * np.arange(1, 11), s, np.zeros(10), s, strict=True))
    return gain_filter.wait(PRIOR, state, 6600.0), np.array([[30e-6, 0.0]])


def test_an_outlier_is_left_out_and_told():
    state, parts = settled()
    after, told = gain_filter.assimilate(PRIOR, state, parts, np.array([80e-6]), 1e-6)
    assert [t.accepted for t in told] == [False]
    assert told[0].innovation == pytest.approx(50e-6, abs=2e-6)
    np.testing.assert_array_equal(after.mean, state.mean)
    again, told = gain_filter.assimilate(PRIOR, after, parts, np.array([30e-6]), 1e-6)
    assert told[0].accepted
    assert np.isnan(again.left_out[0])


def test_two_outliers_that_agree_are_believed():
    state, parts = settled()
    once, _ = gain_filter.assimilate(PRIOR, state, parts, np.array([80e-6]), 1e-6)
    twice, told = gain_filter.assimilate(PRIOR, once, parts, np.array([81e-6]), 1e-6)
    assert told[0].accepted
    assert gain_filter.predict(PRIOR, twice, parts)[0][0] > 45e-6


def test_uncertainty_is_a_sawtooth():
    """Paper 000, Fig. 1: it grows between measurements and falls with each."""
    state = gain_filter.begin(PRIOR, 0.0, 1)
    parts = np.array([[30e-6, 10e-6]])
    for hour in range(1, 6):
        grown = [
            gain_filter.predict(PRIOR, gain_filter.wait(PRIOR, state, HOUR * (hour - 1) + t), parts)[1][0]
            for t in np.linspace(0.0, HOUR, 7)
        ]
        assert np.all(np.diff(grown) > 0.0)
        state = gain_filter.wait(PRIOR, state, HOUR * hour)
        state, _ = gain_filter.assimilate(PRIOR, state, parts, np.array([25e-6]), 1e-6)
        assert gain_filter.predict(PRIOR, state, parts)[1][0] < grown[-1]


@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0])
def test_intervals_cover_95_percent_of_walks_whose_size_is_not_known(scale):
    rng = np.random.default_rng(3)
    inside = []
    for _ in range(40):
        time = 300.0 * np.arange(1, 97)
        s = 60e-6 * (1.0 - np.exp(-time / 6000.0))
        walk = np.cumsum(np.sqrt(1 / 12) * rng.standard_normal((96, 2)), axis=0)
        gain = 1.0 + scale * (0.1 * rng.standard_normal() + 0.02 * walk[:, 0])
        offset = scale * (2e-6 * rng.standard_normal() + 1e-6 * walk[:, 1])
        truth = gain * s + offset
        lived = replay_online(PRIOR, time, s, truth + 1e-6 * rng.standard_normal(96), 1e-6, 1800.0)
        inside.append((np.abs(truth - lived.predicted) <= 1.96 * lived.sigma)[~lived.used])
    assert 0.90 <= np.mean(inside) <= 0.985


def test_a_slow_answer_is_foreseen_once_it_has_begun():
    """The structure answers with 30 % of the error, through a lag of 3 h; a gain alone follows, but late."""
    time = 300.0 * np.arange(1, 97)
    s = 80e-6 * (1.0 - np.exp(-time / 1500.0))
    slow, lagged = np.zeros(1), []
    for value in s:
        slow = gain_filter.lagged(PRIOR, slow, np.array([value]), 300.0)
        lagged.append(slow[0])
    truth = s - 0.3 * np.array(lagged)
    without = GainPrior(sigma=(0.1, 1e-9, 2e-6), walk=(0.02, 1e-9, 1e-6))
    errors = []
    for prior in (PRIOR, without):
        lived = replay_online(prior, time, s, truth, 0.1e-6, 3600.0)
        errors.append(np.sqrt(np.mean((lived.predicted - truth)[24:] ** 2)))
    assert errors[0] < 0.4 * errors[1]


def test_a_new_segment_begins_closer_to_the_base_model_and_less_sure():
    state, parts = settled()
    state, _ = gain_filter.assimilate(PRIOR, state, parts, np.array([33e-6]), 1e-6)
    new = gain_filter.begin_segment(PRIOR, state, 0.0)
    old_gain, new_gain = (abs(v.mean[2, 0, 0] - 1.0) for v in (state, new))
    assert new_gain == pytest.approx(0.5 * old_gain)
    np.testing.assert_array_equal(new.mean[:, :, 2], 0.0)  # the machine has cooled: no offset
    assert np.all(new.covariance[:, 0, 0, 0] > state.covariance[:, 0, 0, 0])


def test_state_is_restored_exactly():
    state, parts = settled()
    state, _ = gain_filter.assimilate(PRIOR, state, parts, np.array([80e-6]), 1e-6)
    back = GainState.from_json(json.loads(json.dumps(state.to_json())))
    for name in ("mean", "covariance", "weight", "left_out"):
        np.testing.assert_array_equal(getattr(back, name), getattr(state, name))
    measured = np.array([31e-6])
    a, b = (gain_filter.assimilate(PRIOR, gain_filter.wait(PRIOR, v, 9e3), parts, measured)[0] for v in (state, back))
    np.testing.assert_array_equal(a.mean, b.mean)
