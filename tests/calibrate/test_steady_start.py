"""A run that starts after a rest: full model, runtime and calibration begin in the same steady state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.calibrate.lumped_case import artefact, finer, truth
from twin.build.simulate import simulate
from twin.calibrate.fit.problem import problem
from twin.errors import LogError
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.logs.write import write_run
from twin.rom.drive import evaluate
from twin.rom.rest import rest_before
from twin.run.replay import replay


@pytest.fixture(scope="module")
def rested():
    return replace(truth({}, noise=0.0), initial_temperature=None, steady_start=True)


def test_full_model_and_runtime_start_alike(rested):
    model = finer().thermal
    drive = evaluate(model.load_model, rested.loads.time, signal_values(rested, model.load_model.signals), 60.0)
    none = np.zeros((0, len(model.pose_axes)))
    full = simulate(finer(), drive, np.zeros(0), none, None)
    result = replay(artefact(), rested, 60.0)
    assert np.ptp(full.temperatures[0]) > 0.1  # coolant and air differ: no uniform start would do
    np.testing.assert_allclose(result.temperature[0], full.temperatures[0], atol=2e-3)
    np.testing.assert_allclose(result.temperature[5], full.temperatures[5], atol=0.02)


def test_steady_state_stays_without_heat(rested):
    model = artefact().model
    drive = evaluate(model.load_model, rested.loads.time, signal_values(rested, model.load_model.signals), 60.0)
    once, again = rest_before(drive), rest_before(rest_before(drive))
    assert not once.power.any()
    assert once.time[-1] == drive.time[0]
    np.testing.assert_array_equal(once.environment, again.environment)


def test_calibration_starts_there_too(rested):
    art = artefact()
    made = problem(art, [rested], art.parameters)
    assert not made.starts  # the rest forgets where it began
    temperature, _ = made.outputs(np.zeros(len(made.scale)))[0]
    m = made.runs[0].measured
    result = replay(art, rested, 60.0)
    of = [result.sensors.index(s) for s in m.sensors]
    expected = m.mean_of[:, -len(result.time) :] @ result.temperature[:, of]
    np.testing.assert_allclose(temperature, expected, atol=0.02)  # the window model is a reduced one


def test_derivatives_go_through_the_rest(rested):
    """Warmer surroundings warm the start: by 1 K per kelvin where a body knows no other."""
    art = artefact()
    air = [p for p in art.parameters if p.kind == "environment"][:1]
    if not air:
        pytest.skip("no environment among the parameters")
    made = problem(art, [rested], air)
    d = made.jacobian(np.zeros(1))[0][0] / air[0].sigma
    assert 0.05 < d[0].max() <= 1.0 + 1e-9


def test_run_folder_keeps_it(rested, tmp_path):
    write_run(tmp_path / "r", rested)
    back = read_run(tmp_path / "r")
    assert back.steady_start
    assert back.initial_temperature is None


def test_temperature_signals_are_read_from_temperatures(rested):
    """A logged temperature that a law reads may stand in temperatures.csv."""
    model = artefact().model
    name = next(s.column for s in model.load_model.signals if s.unit == "degC" and s.column in rested.loads.columns)
    without_it = {k: v for k, v in rested.loads.columns.items() if k != name}
    loads = replace(rested.loads, columns=without_it, units={k: rested.loads.units[k] for k in without_it})
    table = rested.temperatures
    columns = {**table.columns, name: np.interp(table.time, rested.loads.time, rested.loads.columns[name])}
    moved = replace(
        rested, loads=loads, temperatures=replace(table, columns=columns, units={**table.units, name: "degC"})
    )
    found = signal_values(moved, model.load_model.signals)
    expected = signal_values(rested, model.load_model.signals)
    key = next(s.name for s in model.load_model.signals if s.column == name)
    good = np.isfinite(found[key])
    assert good.mean() > 0.95
    np.testing.assert_allclose(found[key][good], expected[key][good], atol=0.02)
    without = replace(moved, temperatures=None)
    with pytest.raises(LogError, match=name):
        signal_values(without, [replace(s, default=None) for s in model.load_model.signals])
