"""Readings that are set aside, where a model needs a value or a fit would miss them: what all others say."""

from dataclasses import replace

import numpy as np
import pytest

from tests.logs.faults.test_usable import made
from twin.calibrate.channels.filled import filled
from twin.calibrate.channels.judge import judge, set_aside
from twin.inject.damage.channels import Damage, with_load
from twin.inject.damage.kinds import damaged
from twin.logs.run import Run

HOUR = 3600.0
AIR = "t3"


def driven() -> list[Run]:
    """Two runs whose loads have a logged temperature, too."""
    return [_as_driven(made(seed)) for seed in (1, 2)]


def _as_driven(run: Run) -> Run:
    units = {**run.loads.units, AIR: "degC"}
    run = replace(run, loads=replace(run.loads, units=units))
    return with_load(run, AIR, np.array(run.temperatures.columns[AIR]))


@pytest.mark.parametrize(
    "damage",
    [
        Damage("sensor", f"sensors.{AIR}", 5400.0, "stuck", start=2 * HOUR),
        Damage("sensor", f"sensors.{AIR}", -200.0, "rail", start=3 * HOUR),
        Damage("sensor", f"sensors.{AIR}", 8.0, "offset", start=3 * HOUR),
        Damage("sensor", f"sensors.{AIR}", np.nan, "swapped", other="sensors.t0", start=3 * HOUR),
    ],
    ids=lambda d: d.history,
)
def test_a_channel_at_fault_drives_the_model_by_what_all_others_say(damage):
    runs = driven()
    bad = [_as_driven(damaged(runs[0], damage)), runs[1]]
    found = judge(bad).findings
    assert {c for f in found for c in f.channels} >= {AIR}
    before, sound = (r[0].loads.columns[AIR] - runs[0].loads.columns[AIR] for r in (bad, set_aside(bad, found)))
    assert np.abs(before).max() > 1.0
    assert np.isfinite(sound).all()
    assert np.sqrt(np.mean(sound**2)) < 0.25  # K; the noise is 0.03 K, bins of 10 min of what moves within the hour
    assert np.array_equal(set_aside(bad, found)[1].loads.columns[AIR], runs[1].loads.columns[AIR])


def test_loads_of_another_reading_stay():
    runs = driven()
    bad = [damaged(runs[0], Damage("sensor", f"sensors.{AIR}", -200.0, "rail", start=3 * HOUR)), runs[1]]
    found = judge(bad).findings
    assert {c for f in found for c in f.channels} == {AIR}
    assert set_aside(bad, found)[0].loads is bad[0].loads


def test_readings_that_others_know_stand_in_for_lost_ones():
    runs = [made(seed) for seed in (1, 2)]
    bad = [damaged(runs[0], Damage("sensor", f"sensors.{AIR}", -200.0, "rail", start=3 * HOUR)), runs[1]]
    sound = set_aside(bad, judge(bad).findings)
    lost = np.isnan(sound[0].temperatures.columns[AIR])
    first, second = filled(bad, sound, 0.5)
    error = first.temperatures.columns[AIR] - runs[0].temperatures.columns[AIR]
    assert lost.mean() > 0.5
    assert np.isfinite(error).all()
    assert np.sqrt(np.mean(error[lost] ** 2)) < 0.25  # K: bins of 10 min of what moves within the hour
    np.testing.assert_array_equal(error[~lost], 0.0)
    assert np.array_equal(second.temperatures.columns[AIR], runs[1].temperatures.columns[AIR])
    none = filled(bad, sound, 0.0)[0].temperatures.columns[AIR]
    assert np.isnan(none[lost]).all()


def test_what_was_never_logged_stays_missing():
    run = made()
    gap = np.array(run.temperatures.columns[AIR])
    gap[100:200] = np.nan
    run = replace(run, temperatures=replace(run.temperatures, columns={**run.temperatures.columns, AIR: gap}))
    (after,) = filled([run], [run], 0.5)
    np.testing.assert_array_equal(after.temperatures.columns[AIR], gap)
