"""The play operator: what follows a motion through a clearance."""

from __future__ import annotations

import numpy as np
import pytest

from twin.physics.play import play


def test_what_follows_stays_half_the_play_behind():
    up_and_down = np.concatenate([np.linspace(0.0, 10.0, 50), np.linspace(10.0, 0.0, 50)])
    follower = play(up_and_down, 2.0)
    assert follower[49] == pytest.approx(9.0)
    assert follower[-1] == pytest.approx(1.0)
    assert np.abs(follower - up_and_down).max() <= 1.0 + 1e-12


def test_within_the_play_nothing_moves():
    assert np.array_equal(play([0.0, 0.4, -0.4, 0.3], 1.0), np.zeros(4))
    assert np.array_equal(play([1.0, 3.0, -2.0], 0.0), [1.0, 3.0, -2.0])  # no play
    assert play([], 1.0).shape == (0,)


def test_the_order_of_turns_is_remembered_not_their_speed():
    slow, fast = np.interp(np.arange(31.0), [0, 10, 20, 30], [0, 5, 1, 4]), np.array([0.0, 5.0, 1.0, 4.0])
    assert np.allclose(play(slow, 2.0)[::10], play(fast, 2.0))
