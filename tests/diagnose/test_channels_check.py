"""A stuck sensor is emptied where it is stuck: not where it rests, and not where it says nothing."""

from __future__ import annotations

import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.logs.faults.test_usable import changed, made
from twin.calibrate.channels.finding import Finding
from twin.calibrate.channels.judge import Judgement, judge
from twin.diagnose.faults.channels_check import channels_at_fault, judged_channels, warm_place_note
from twin.diagnose.result.diagnosis import Cause
from twin.logs.run import Run, Table

HOUR = 3600.0
TIME = 30.0 * np.arange(1800)  # 15 h
NIGHT = (TIME >= 8 * HOUR) & (TIME < 14 * HOUR)
NAMES = ("a", "b", "c")
THREE = ("t0", "t1", "t2")


def temperatures(resolution: float = 0.0) -> dict[str, np.ndarray]:
    """8 h of work that starts and stops, 6 h of rest in which nothing changes, and work again."""
    rng = np.random.default_rng(4)
    columns = {}
    for k, name in enumerate(NAMES):
        values = 22.0 + (1.5 + 0.4 * k) * np.sin(TIME / 900.0 + k) + 0.02 * rng.standard_normal(len(TIME))
        if resolution:
            rest = 21.0 + (values - 21.0) * np.exp(-np.maximum(TIME - 8 * HOUR, 0.0) / 600.0)
            wakes = 21.0 + (values - 21.0) * -np.expm1(-np.maximum(TIME - 14 * HOUR, 0.0) / 600.0)
            values = resolution * np.round(np.where(TIME < 14 * HOUR, rest, wakes) / resolution)
        columns[name] = values
    return columns


def at_fault(runs: list[Run], names: list[str]) -> tuple[list[Run], list[Cause]]:
    return channels_at_fault(runs, judge(runs), NAMES, names)


def checked(columns: dict[str, np.ndarray]) -> tuple[dict[str, np.ndarray], list[tuple[str, float, float]]]:
    """Columns after the check, and (place, start, end) of each cause."""
    run = Run(Table(TIME, {}, {}), Table(TIME, columns, dict.fromkeys(columns, "degC")))
    (after,), causes = at_fault([run], ["run"])
    assert after.temperatures is not None
    assert all(c.history == "stuck" for c in causes)
    return dict(after.temperatures.columns), [(c.place, w.start, w.end) for c in causes for w in c.windows]


def test_a_frozen_hour_of_work_and_not_the_longer_rest_at_night():
    columns = temperatures(resolution=0.1)
    assert checked(columns)[1] == []
    frozen = (TIME >= 3 * HOUR) & (TIME <= 4 * HOUR)
    columns["b"] = np.where(frozen, columns["b"][TIME == 3 * HOUR], columns["b"])
    after, ((place, start, end),) = checked(columns)
    assert place == "sensors.b"
    assert (start, end) == pytest.approx((3 * HOUR, 4 * HOUR), abs=200.0)  # what was the same before and after too
    assert np.isnan(after["b"][frozen]).all()
    np.testing.assert_array_equal(after["b"][NIGHT], columns["b"][NIGHT])


@pytest.mark.parametrize("every", [2, 3, 7])
def test_empty_cells_here_and_there_hide_no_frozen_channel(every):
    columns = temperatures()
    frozen = (TIME >= 3 * HOUR) & (TIME <= 5 * HOUR)
    columns["b"] = np.where(frozen, 22.5, columns["b"])
    columns["b"][::every] = np.nan
    after, ((place, start, end),) = checked(columns)
    assert place == "sensors.b"
    assert (start, end) == pytest.approx((3 * HOUR, 5 * HOUR), abs=30.0)
    assert np.isnan(after["b"][frozen]).all()
    np.testing.assert_array_equal(after["b"][~frozen], columns["b"][~frozen])


def test_a_silent_channel_is_not_stuck():
    columns = temperatures(resolution=0.1)
    columns["b"][(TIME >= 4 * HOUR) & (TIME < 7 * HOUR)] = np.nan
    columns["c"][TIME >= 5 * HOUR] = np.nan
    columns["c"][:200] = np.nan
    after, found = checked(columns)
    assert found == []
    for name in NAMES:
        np.testing.assert_array_equal(after[name], columns[name])


def test_a_channel_that_froze_in_one_run_is_frozen_in_all_of_the_next():
    first, second = temperatures(), temperatures()
    first["b"] = np.where(TIME >= 9 * HOUR, 22.5, first["b"])
    second["b"], second["c"] = np.full(len(TIME), 22.1), np.full(len(TIME), np.nan)
    runs = [Run(Table(TIME, {}, {}), Table(TIME, own, dict.fromkeys(own, "degC"))) for own in (first, second)]
    usable, causes = at_fault(runs, ["monday", "tuesday"])
    assert [(c.place, c.windows[0].run) for c in causes] == [("sensors.b", "monday"), ("sensors.b", "tuesday")]
    assert [np.isfinite(run.temperatures.columns["b"]).sum() for run in usable] == [1080, 0]
    # alone, the second run does not tell how often it should have changed
    assert at_fault(runs[1:], ["tuesday"])[1] == []


def test_a_run_at_rest_is_not_a_frozen_channel():
    work, rest = temperatures(resolution=0.1), {name: np.full(len(TIME), 21.0) for name in NAMES}
    runs = [Run(Table(TIME, {}, {}), Table(TIME, own, dict.fromkeys(own, "degC"))) for own in (work, rest)]
    assert at_fault(runs, ["work", "rest"])[1] == []


def test_a_sensor_that_breaks_is_named_with_its_size_and_left_out_of_what_is_fitted():
    run = made()
    broken = run.temperatures.columns["t3"].copy()
    broken[200:] = 850.0
    leapt = run.temperatures.columns["t1"].copy()
    leapt[300:] += 7.0
    runs = [changed(changed(run, "t3", broken), "t1", leapt), made(2)]
    judgement, names = judge(runs), ("monday", "tuesday")
    usable, causes = channels_at_fault(runs, judgement, ("t1", "t3"), names)
    by_place = {c.place: c for c in causes}
    assert set(by_place) == {"sensors.t1", "sensors.t3"}
    assert by_place["sensors.t3"].history == "rail"
    assert (by_place["sensors.t3"].amplitude, by_place["sensors.t3"].unit) == (850.0, "degC")
    assert "leap" in by_place["sensors.t1"].history
    assert abs(by_place["sensors.t1"].amplitude - 7.0) < 0.5
    assert {w.run for c in causes for w in c.windows} == {"monday"}
    assert np.isnan(usable[0].temperatures.columns["t3"][200:]).all()
    assert np.isfinite(usable[0].temperatures.columns["t3"][:200]).all()


def test_a_leap_without_witnesses_is_told_of_sensors_of_the_machine_alone():
    run = made()
    few = replace(run, temperatures=replace(run.temperatures, columns={n: run.temperatures.columns[n] for n in THREE}))
    leapt = few.temperatures.columns["t1"].copy()
    leapt[300:] += 7.0
    few = changed(few, "t1", leapt)
    (cause,) = channels_at_fault([few], judge([few]), ("t0", "t1"), ["monday"])[1]
    assert (cause.place, cause.history) == ("sensors.t1", "leap")
    assert abs(cause.amplitude - 7.0) < 0.5
    assert channels_at_fault([few], judge([few]), ("t0",), ["monday"])[1] == []


def test_a_place_that_is_always_warmer_is_no_fault_where_the_model_does_not_know_it(monkeypatch):
    def offset(channel: str, *runs: int) -> Finding:
        return Finding("offset", (channel,), runs, 0.0, HOUR, 5.75, (4.7, 6.8), 116.0, 25.0)

    known = (offset("bed", 0, 1), offset("oil", 1), replace(offset("oil", 0, 1), what="drift"))
    every = Judgement((*known, offset("oil", 0, 1)), (), ())
    runs = 2 * [Run(Table(TIME, {}, {}), Table(TIME, temperatures(), dict.fromkeys(NAMES, "degC")))]
    monkeypatch.setattr(sys.modules[judge.__module__], "judged", lambda *_: every)
    assert judge(runs) == every
    told = judge(runs, sensors={"bed"})
    assert told.findings == known
    (warm,) = told.warm
    assert warm_place_note(warm, ()).startswith("oil is off by 5.8 K (95 % interval 4.7 to 6.8 K)")
    assert warm_place_note(warm, ()).endswith("the model has no sensor there")


def test_an_offset_of_a_sensor_in_all_runs_is_left_to_the_search(monkeypatch):
    """The others refute it as well where an undescribed source warms its place at all times. Of air, which drives the
    model, and of one run alone, they are believed."""

    def offset(channel: str, *runs: int) -> Finding:
        return Finding("offset", (channel,), runs, 0.0, HOUR, 5.75, (4.7, 6.8), 116.0, 25.0)

    always, once, air, oil = offset("bed", 0, 1), offset("bed", 1), offset("room", 0, 1), offset("oil", 0, 1)
    runs = 2 * [Run(Table(TIME, {}, {}), Table(TIME, temperatures(), dict.fromkeys(NAMES, "degC")))]
    every = Judgement((always, once, air, oil), (), ())
    monkeypatch.setattr(sys.modules[judge.__module__], "judged", lambda *_: every)
    model = SimpleNamespace(sensors=("bed",), ambient_sensors=(("room", 0),))
    told = judged_channels(runs, model)
    assert told.findings == (once, air)
    assert told.warm == (always, oil)
    assert warm_place_note(always, model.sensors).endswith("no cause explains it")
    nothing_read = Run(Table(TIME, {}, {}))  # a run of the tool alone is none of those with temperatures
    assert judged_channels([*runs, nothing_read], model).findings == (once, air)
