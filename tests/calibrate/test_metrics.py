"""Figures of merit against the numbers of the papers and their errata."""

import numpy as np
import pytest

from twin.calibrate.score.metrics import figures, fit, p2p, p2p_003, share


def test_p2p_003_overstates_where_the_residual_keeps_its_sign():
    """Erratum E-003-4: residual 5 .. 9 um: 14 against 4."""
    assert p2p_003(np.array([5.0, 9.0, 7.0])) == 14.0
    assert p2p(np.array([5.0, 9.0, 7.0])) == 4.0
    assert p2p_003(np.array([-2.0, 3.0])) == p2p(np.array([-2.0, 3.0])) == 5.0


def test_fit_is_100_0_and_negative():
    z = np.array([1.0, 4.0, -2.0, 7.0])
    assert fit(z, z) == 100.0
    assert fit(z, np.full(4, z.mean())) == pytest.approx(0.0)
    assert fit(z, z - 2.0 * (z - z.mean())) == pytest.approx(-100.0)
    assert fit(np.full(4, 3.0), z) is None


def test_share_is_that_of_erratum_e_000_6():
    """38 um with 7 um left is 81.6 %, 17 um with 7 left 58.8 %, 48 um with 13 left 72.9 %."""
    for measured, left, expected in ((38.0, 7.0, 0.816), (17.0, 7.0, 0.588), (48.0, 13.0, 0.729)):
        z = np.full(5, measured)
        assert share(z, z - left, 1.0) == pytest.approx(expected, abs=5e-4)


def test_no_share_where_hardly_anything_was_measured():
    z = np.array([3.0, -3.0, 3.0, -3.0])
    assert share(z, np.zeros(4), 1.01) is None
    assert share(z, np.zeros(4), 0.99) == 0.0
    told = figures(z, 0.9 * z, np.full(4, 1.1))
    assert told.share is None
    assert told.percent_of_max is None
    assert told.fit == pytest.approx(90.0)


def test_vectors_are_scored_by_their_length():
    measured = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 10.0]])
    told = figures(measured, np.zeros((2, 3)), np.full(2, 1.0))
    assert told.rms == pytest.approx(np.sqrt((25.0 + 100.0) / 2.0))
    assert told.max_abs == 10.0
    assert told.uncertainty == pytest.approx(np.sqrt(3.0))
    assert told.share == 0.0
    assert told.p2p is None
    one = figures(measured[:, 2], measured[:, 2] - np.array([1.0, 2.0]), np.full(2, 0.1))
    assert (one.mean, one.p2p, one.p2p_003, one.max_abs) == (1.5, 1.0, 3.0, 2.0)
    assert one.percent_of_max == pytest.approx(20.0)
