"""Temperature channels judged by each other: on the stored full-model runs of the five-axis machine, damaged or not."""

from dataclasses import replace

import numpy as np
import pytest

from models.recordings import lathe_days, lathe_run
from tests.hidden.trials import trial
from twin.calibrate.channels.judge import judge, set_aside, words
from twin.calibrate.channels.readings import readings
from twin.calibrate.channels.refute import refuted
from twin.calibrate.fit.weights import stretch_weights
from twin.inject.damage.channels import Damage
from twin.inject.damage.kinds import damaged

HOUR = 3600.0
EVERY = 3  # of the sensors: enough witnesses, and quick


@pytest.fixture(scope="module")
def runs():
    """Two runs of the machine as another mesh and other laws of films have it, with noise."""
    found = []
    for run in trial("null_0").runs[:2]:
        table = run.temperatures
        names = list(table.columns)[::EVERY]
        found.append(
            replace(
                run,
                temperatures=replace(
                    table, columns={n: table.columns[n] for n in names}, units=dict.fromkeys(names, "degC")
                ),
            )
        )
    return found


def test_a_sound_machine_has_no_channel_at_fault(runs):
    assert judge(runs).findings == ()


@pytest.mark.parametrize(("size", "start"), [(3.0, 4 * HOUR), (-6.0, 7 * HOUR)])
def test_a_leap_is_named_with_its_size_and_set_aside(runs, size, start):
    name = "column_front_middle"
    bad = [damaged(runs[0], Damage("sensor", f"sensors.{name}", size, "offset", start=start)), runs[1]]
    (found,) = judge(bad).findings
    assert (found.what, found.channels, found.runs) == ("leap", (name,), (0,))
    assert found.size == pytest.approx(size, rel=0.1)
    assert found.start == pytest.approx(start, abs=1200.0)  # two bins
    time, sound = bad[0].temperatures.time, runs[0].temperatures.columns[name]
    first, other = (run.temperatures.columns[name] for run in set_aside(bad, [found]))
    near = np.abs(time - found.start) <= 1200.0
    assert np.isfinite(other).all()
    if np.ptp(found.interval) <= 1.0:  # known to half a kelvin
        assert np.isnan(first[near]).all()
        np.testing.assert_allclose(first[~near], sound[~near], atol=0.1 * abs(size))
    vague = replace(found, interval=(found.size - 2.0, found.size + 2.0))
    first = set_aside(bad, [vague])[0].temperatures.columns[name]
    assert np.isnan(first[time > found.start]).all()
    assert np.isfinite(first[time < found.start]).all()
    assert f"'{name}' reads" in words(found, ["monday", "tuesday"])


@pytest.mark.parametrize("elsewhere", [0.0, 7.0])
def test_what_rises_as_far_within_minutes_is_no_leap(runs, elsewhere):
    """As a sensor on a screw does that a warm nut comes to: by all others alone it would be one. Nor is it where two
    readings of another hour are as far from each other."""
    name, size, start = "column_front_middle", 6.0, 4 * HOUR
    table = runs[0].temperatures
    rise = size * np.clip((table.time - start) / 1200.0, 0.0, 1.0)
    rise[np.searchsorted(table.time, 8 * HOUR)] += elsewhere
    warm = replace(runs[0], temperatures=replace(table, columns=table.columns | {name: table.columns[name] + rise}))
    assert {(f.what, f.channels) for f in refuted(readings([warm, runs[1]]))} == {("leap", (name,))}
    assert judge([warm, runs[1]]).findings == ()


def test_a_leap_that_its_own_rows_show_needs_less_of_the_others(runs):
    name, size, start = "x_motor", 2.0, 4 * HOUR
    bad = damaged(runs[0], Damage("sensor", f"sensors.{name}", size, "offset", start=start))
    table = readings([bad, runs[1]])
    assert refuted(table) == []
    (found,) = refuted(table, [(0, name, start)])
    assert (found.what, found.channels, found.runs) == ("leap", (name,), (0,))
    assert found.size == pytest.approx(size, rel=0.2)
    assert found.least < found.statistic
    assert refuted(table, [(0, name, start + 2 * HOUR)]) == []
    assert refuted(table, [(0, "column_right", start)]) == []


def test_a_drift_and_an_offset_of_one_run_are_named(runs):
    name = "column_right"
    (drift,) = judge([damaged(runs[0], Damage("sensor", f"sensors.{name}", 4.0, "drift")), runs[1]]).findings
    assert (drift.what, drift.channels) == ("drift", (name,))
    assert drift.size == pytest.approx(4.0, rel=0.2)
    (offset,) = judge([runs[0], damaged(runs[1], Damage("sensor", f"sensors.{name}", -5.0, "offset"))]).findings
    assert (offset.what, offset.channels, offset.runs) == ("offset", (name,), (1,))
    assert offset.size == pytest.approx(-5.0, rel=0.2)


def test_a_swapped_pair_is_named_as_a_pair(runs):
    warm, cold = "column_right", "bed_x_middle"
    swapped = Damage("sensor", f"sensors.{warm}", np.nan, "swapped", other=f"sensors.{cold}", start=3 * HOUR)
    (found,) = judge([damaged(runs[0], swapped), runs[1]]).findings
    assert found.what == "swapped"
    assert set(found.channels) == {warm, cold}
    back, sound = set_aside([damaged(runs[0], swapped)], [found])[0].temperatures, runs[0].temperatures
    for name in (warm, cold):
        known = np.isfinite(back.columns[name])
        np.testing.assert_array_equal(back.columns[name][known], sound.columns[name][known])
        assert known.mean() > 0.9


def test_a_rail_is_read_and_not_estimated(runs):
    name = "x_rail_2"
    rail = damaged(runs[1], Damage("sensor", f"sensors.{name}", -200.0, "rail", start=5 * HOUR))
    (found,) = judge([runs[0], rail]).findings
    assert (found.what, found.channels, found.runs, found.size) == ("rail", (name,), (1,), -200.0)


def test_too_few_witnesses_refute_nobody(runs):
    few = [
        replace(r, temperatures=replace(r.temperatures, columns=dict(list(r.temperatures.columns.items())[:3])))
        for r in runs
    ]
    name = "x_motor"
    assert judge([damaged(few[0], Damage("sensor", f"sensors.{name}", 9.0, "offset")), few[1]]).findings == ()


@pytest.mark.skipif(not lathe_days(), reason="no measured data")
def test_the_spliced_day_of_a_lathe_is_told_with_its_line_and_no_channel_is_blamed():
    days = {p.stem: p for p in lathe_days()}
    found = judge([lathe_run(days["20200706"]), lathe_run(days["20200701"])])
    ((run, splice),) = found.splices
    assert (run, splice.first_row + 2, found.findings) == (0, 560, ())


def test_noise_alone_keeps_plain_least_squares():
    rng = np.random.default_rng(2)
    time = np.arange(0.0, 12 * HOUR, 300.0)
    for _ in range(20):
        for weight in stretch_weights([rng.standard_normal(len(time)) for _ in range(2)], [time, time]):
            np.testing.assert_array_equal(weight, 1.0)


def test_a_bad_hour_loses_its_weight_and_no_other():
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 12 * HOUR, 300.0)
    white = rng.standard_normal(len(time))
    bad = (time >= 5 * HOUR) & (time < 6 * HOUR)
    white[bad] += 15.0
    (weight,) = stretch_weights([white], [time])
    assert weight[bad].max() < 0.03
    assert weight[~bad].min() > 0.3
    assert stretch_weights([], []) == []
