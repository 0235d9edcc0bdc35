"""Warm-up times against exact exponentials, and against values that never settle or come back."""

import numpy as np
import pytest

from twin.errors import TwinError
from twin.run.warmup import History, end_rate, last_entry, read_history, settling, warm_up

TAU = 1800.0
TIME = np.arange(0.0, 12 * TAU + 1.0, 10.0)
RISE = 1.0 - np.exp(-TIME / TAU)


def test_one_time_constant_settles_as_its_exponential():
    s = settling(TIME, 40e-6 * RISE, 1e-6)
    assert s.settled
    assert s.change == pytest.approx(40e-6, rel=1e-5)
    assert s.t63 == pytest.approx(TAU, rel=1e-4)
    assert s.t95 == pytest.approx(-TAU * np.log(0.05), rel=1e-3)  # 2.996 tau
    assert s.time == pytest.approx(TAU * np.log(40.0), rel=1e-3)  # 40 exp(-t/tau) = 1
    assert abs(s.rate) * 3600.0 < 1e-9


@pytest.mark.parametrize("length", [1.0, 2.0, 4.0])
def test_a_run_that_was_stopped_early(length):
    """Exact for a cut exponential: rate A/tau exp(-T/tau), t63 and t95 of the change within the run."""
    end = length * TAU
    time = np.arange(0.0, end + 1.0, 5.0)
    s = settling(time, 40e-6 * (1.0 - np.exp(-time / TAU)), 1e-6, window=30.0)
    left = np.exp(-length)
    assert s.rate == pytest.approx(40e-6 / TAU * left, rel=0.01)
    assert (s.settled, s.time) == (abs(s.rate) * 3600.0 <= 1e-6, None)
    assert s.t63 == pytest.approx(-TAU * np.log(left + (1.0 - left) / np.e), rel=1e-3)
    assert s.t95 == pytest.approx(-TAU * np.log(left + 0.05 * (1.0 - left)), rel=1e-3)


def test_settled_follows_the_tolerance_and_the_horizon():
    time = TIME[TIME <= 6 * TAU]
    value = 40e-6 * (1.0 - np.exp(-time / TAU))
    rate = 40e-6 / TAU * np.exp(-6.0)  # 55 pm/s, 0.20 um/h
    assert settling(time, value, 1.3 * rate * 3600.0).settled
    assert not settling(time, value, 0.7 * rate * 3600.0).settled
    assert settling(time, value, 0.7 * rate * 3600.0, horizon=1800.0).settled


def test_a_value_that_comes_back():
    """u exp(-u), u = t/tau: largest distance 1/e at tau; from then on it must fall below 1/e^2 (t63)."""
    u = TIME / TAU
    end = u[-1] * np.exp(-u[-1])
    s = settling(TIME, -30e-6 * u * np.exp(-u), 0.5e-6)
    assert s.change == pytest.approx(30e-6 * (1.0 / np.e - end), rel=1e-4)
    assert abs(s.final) < 0.01e-6
    for share, found in ((np.exp(-1.0), s.t63), (0.05, s.t95)):
        v = found / TAU
        assert v > 1.0
        assert v * np.exp(-v) - end == pytest.approx(share * (1.0 / np.e - end), rel=1e-3)


def test_a_value_that_never_left():
    s = settling(TIME, 0.2e-6 * RISE, 1e-6)
    assert (s.settled, s.time) == (True, 0.0)
    still = settling(TIME, np.full_like(TIME, 3.0), 1.0)
    assert (still.change, still.rate, still.time, still.t63, still.t95) == (0.0, 0.0, 0.0, 0.0, 0.0)


def test_a_ramp_is_never_warm():
    s = settling(TIME, 1e-9 * TIME, 1e-6)  # 3.6 um/h
    assert (s.settled, s.time) == (False, None)
    assert s.rate == pytest.approx(1e-9, rel=1e-9)
    assert s.t95 == pytest.approx(0.95 * TIME[-1], rel=1e-9)


def test_the_end_of_the_run_is_no_time_to_be_warm():
    """Only the last sample lies within the tolerance: of itself, whatever the rate."""
    time = np.arange(0.0, 7201.0, 60.0)
    cycle = 5e-6 * np.sin(np.pi * np.arange(len(time)) / 2 + 0.1)  # four samples a cycle, no drift
    assert abs(end_rate(time, cycle, 600.0)) < 1e-8
    s = settling(time, cycle, 1e-6, horizon=60.0)
    assert (s.settled, s.time) == (False, None)
    step = np.where(time < time[-1], 0.0, 2e-6)
    assert settling(time, step, 1e-6, horizon=1.0).time is None
    earlier = np.where(time < time[-2], 0.0, 2e-6)
    assert settling(time, earlier, 1e-6, horizon=1.0).time == pytest.approx(time[-2] - 30.0)


def test_end_rate_reads_its_window_only():
    time = np.arange(0.0, 3601.0, 60.0)
    value = np.where(time < 3000.0, 7.0, 0.0) + 2e-3 * time
    assert end_rate(time, value, 600.0) == pytest.approx(2e-3, rel=1e-9)
    assert end_rate(time, value, 660.0) < 0.0  # sees the step
    assert end_rate(time, value, 1.0) == pytest.approx(2e-3, rel=1e-9)  # two samples at least


def test_last_entry_is_linear_between_samples():
    assert last_entry(np.array([0.0, 10.0, 20.0]), np.array([4.0, 2.0, 0.0]), 1.0) == pytest.approx(15.0)
    assert last_entry(np.array([0.0, 10.0, 20.0, 30.0]), np.array([0.0, 3.0, 0.5, 0.0]), 1.0) == pytest.approx(18.0)


def history(time: np.ndarray) -> History:
    """Two poses, dx largest at pose 1, dy at pose 0; one fast and one slow sensor."""
    fast, slow = 1.0 - np.exp(-time / 600.0), 1.0 - np.exp(-time / 36000.0)
    tcp = np.zeros((len(time), 2, 3))
    tcp[:, 0, 0], tcp[:, 1, 0] = 5e-6 * fast, -9e-6 * fast
    tcp[:, 0, 1], tcp[:, 1, 1] = 80e-6 * slow, 10e-6 * slow
    temperature = 20.0 + np.column_stack([5.0 * fast, 5.0 * slow])
    return History(time, ("fast", "slow"), temperature, ("x",), np.array([[-0.1], [0.1]]), tcp, tcp[:, 0])


def test_worst_poses_and_the_machine_as_a_whole():
    found = warm_up(history(np.arange(0.0, 14401.0, 60.0)), 1e-6, 0.1)
    assert [pose for pose, _ in found.worst.values()] == [1, 0, 0]
    assert found.worst["x"][1].time == pytest.approx(600.0 * np.log(9.0), rel=5e-3)
    assert found.actual["x"].time == pytest.approx(600.0 * np.log(5.0), rel=5e-3)
    assert found.sensors["fast"].time == pytest.approx(600.0 * np.log(50.0), rel=5e-3)
    assert found.sensors["slow"].time is None
    assert (found.settled, found.time) == (False, None)  # dy drifts on
    loose = warm_up(history(np.arange(0.0, 14401.0, 60.0)), 9e-6, 1.0)
    assert loose.settled
    assert loose.time == loose.worst["y"][1].time


def test_a_short_run_is_judged_by_its_last_third():
    assert warm_up(history(np.arange(0.0, 601.0, 60.0)), 1e-6, 0.1).window == pytest.approx(200.0)


def test_needs_samples_and_a_result(tmp_path):
    with pytest.raises(ValueError, match="two samples"):
        settling(np.zeros(1), np.zeros(1), 1.0)
    with pytest.raises(TwinError, match="no result here"):
        read_history(tmp_path)
    (tmp_path / "result.h5").write_text("nothing")
    with pytest.raises(TwinError, match="not a result"):
        read_history(tmp_path / "result.h5")
