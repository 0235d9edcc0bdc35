"""Scoring before assimilating: nobody gains from copying what is about to be scored."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from twin.calibrate.score.metrics import figures
from twin.calibrate.score.prequential import HoldLast, prequential


def measurements(n: int, seed: int, places: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    time = np.repeat(3600.0 * np.arange(n), places)
    position = np.tile(np.linspace(0.0, 0.8, places)[:, None], (n, 1))
    return time, position, rng.standard_normal((n * places, 3)).cumsum(axis=0) * 1e-6


class Copy:
    """A model that has been given perfect gain: it says what the last R-test said."""

    def __init__(self):
        self.last = np.zeros(3)

    def predict(self, time, position):
        return self.last

    def assimilate(self, time, position, measured):
        self.last = measured


def test_a_model_that_copies_the_last_r_test_scores_as_hold_last():
    """To the bit, and not 100 % (erratum E-000-7)."""
    time, position, measured = measurements(40, 1)
    copied = prequential(Copy(), time, position, measured)
    held = prequential(HoldLast(), time, position, measured)
    sigma = np.full(len(time), 1e-7)
    assert figures(measured, copied, sigma) == figures(measured, held, sigma)
    assert figures(measured, copied, sigma).share < 0.9
    np.testing.assert_array_equal(held[1:], measured[:-1])
    np.testing.assert_array_equal(held[0], 0.0)


def test_the_last_one_at_the_same_place():
    time, position, measured = measurements(10, 2, places=3)
    held = prequential(HoldLast(), time, position, measured)
    np.testing.assert_array_equal(held[3:], measured[:-3])
    np.testing.assert_array_equal(held[:3], 0.0)  # of one time: none of them knows of the others
    elsewhere = prequential(HoldLast(), time[:4], np.array([[0.0], [0.0], [0.0], [5.0]]), measured[:4])
    np.testing.assert_array_equal(elsewhere[3], measured[2])  # an unknown place: the last one anywhere


def test_an_interval_keeps_measurements_back():
    time, position, measured = measurements(12, 3)
    held = prequential(HoldLast(3.0 * 3600.0), time, position, measured)
    expected = measured[[0, 0, 0, 3, 3, 3, 6, 6, 6, 9, 9]]
    np.testing.assert_array_equal(held[1:], expected)
    minutes = np.array([0.0, 120.0, 240.0, 300.0, 3600.0])  # three places, one of them again, an hour later
    place = np.array([[0.0], [0.1], [0.2], [0.1], [0.1]])
    held = prequential(HoldLast(1800.0), minutes, place, measured[:5])
    np.testing.assert_array_equal(held[3], measured[1])
    np.testing.assert_array_equal(held[4], measured[1])  # not the one that came too soon


def test_components_that_were_not_measured_are_kept():
    time, position, measured = measurements(3, 4)
    measured[1, 2] = np.nan
    held = prequential(HoldLast(), time, position, measured)
    np.testing.assert_array_equal(held[2], [measured[1, 0], measured[1, 1], measured[0, 2]])


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 3), st.sampled_from([0.0, 7200.0]))
def test_no_prediction_knows_its_own_or_a_later_measurement(seed, places, interval):
    time, position, measured = measurements(8, seed, places)
    shuffled = np.random.default_rng(seed).permutation(len(time))
    time, position, measured = time[shuffled], position[shuffled], measured[shuffled]
    held = prequential(HoldLast(interval), time, position, measured)
    k = seed % len(time)
    changed = np.where((time >= time[k])[:, None], 1.0, measured)
    again = prequential(HoldLast(interval), time, position, changed)
    np.testing.assert_array_equal(again[time <= time[k]], held[time <= time[k]])
