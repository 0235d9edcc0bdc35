"""Temperatures that begin apart: which one, by how much, and whether it is known that the machine was cold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from twin.logs.check import check_run
from twin.logs.faults.find import faults_of
from twin.logs.run import Run, Table

TIME = np.arange(0.0, 4 * 3600.0, 60.0)


def a_run(rest: float = 1800.0, **offsets: float) -> Run:
    """Six temperatures of a machine that is driven after a rest [s]; offsets [K] by name."""
    rng = np.random.default_rng(4)
    heat = np.clip(TIME - rest, 0.0, None) / 3600.0
    columns = {
        n: 21.0 + 0.2 * k + (1.0 + k) * heat + offsets.get(n, 0.0) + 0.02 * rng.standard_normal(len(TIME))
        for k, n in enumerate("abcdef")
    }
    loads = {"speed": np.where(rest < TIME, 50.0, 0.0), "air": np.full(len(TIME), 21.0), "x": 0.1 * np.ones(len(TIME))}
    return Run(
        Table(TIME, loads, {"speed": "1/s", "air": "degC", "x": "m"}),
        Table(TIME, columns, dict.fromkeys(columns, "degC")),
    )


def begins(run: Run) -> list[tuple[str, tuple[str, ...]]]:
    return [(f.kind, f.channels) for f in faults_of(run)]


def test_sensors_that_agree_are_fine():
    assert begins(a_run()) == []
    assert begins(a_run(c=0.9)) == []  # as much as thermocouples differ


@pytest.mark.parametrize("size", [4.0, -7.0])
def test_an_offset_at_a_cold_start(size):
    (found,) = faults_of(a_run(c=size))
    assert (found.kind, found.channels, found.unit) == ("offset", ("c",), "K")
    assert found.size == pytest.approx(size - 0.1, abs=0.6)


def test_whether_the_machine_was_cold_is_not_always_known():
    assert begins(a_run(rest=0.0, c=6.0)) == [("offset_or_warm", ("c",))]
    assert begins(a_run(rest=300.0, c=6.0)) == [("offset_or_warm", ("c",))]
    without = a_run(c=6.0)
    assert begins(replace(without, loads=Table(TIME, {}, {}))) == [("offset_or_warm", ("c",))]
    assert begins(replace(without, loads=Table(TIME, {}, {}), initial_temperature=21.0)) == [("offset", ("c",))]


def test_a_place_that_is_still_warm_is_seen_to_cool():
    run = a_run(rest=3600.0)
    columns = {**run.temperatures.columns, "c": run.temperatures.columns["c"] + 6.0 * np.exp(-TIME / 7200.0)}
    assert begins(replace(run, temperatures=replace(run.temperatures, columns=columns))) == [("offset_or_warm", ("c",))]


def test_one_wrong_value_and_fast_heat_are_no_offsets():
    run = a_run(rest=0.0)
    spike = run.temperatures.columns["c"].copy()
    spike[0] += 9.0
    fast = run.temperatures.columns["d"] + 8.0 * (1.0 - np.exp(-TIME / 120.0))
    columns = {**run.temperatures.columns, "c": spike, "d": fast}
    assert begins(replace(run, temperatures=replace(run.temperatures, columns=columns))) == []


def test_another_scale_is_told_once():
    run = a_run()
    columns = {**run.temperatures.columns, "c": 1.8 * run.temperatures.columns["c"] + 32.0}
    told = [p.what for p in check_run(replace(run, temperatures=replace(run.temperatures, columns=columns)))]
    assert len([what for what in told if "'c' begins" in what]) == 1
    assert any("degF" in what for what in told)
