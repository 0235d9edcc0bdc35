"""The other machine of hidden-effect trials: off by what it says, and not by more."""

from __future__ import annotations

import numpy as np
import pytest

from tests.hidden.trials import EXPERIMENT, MODEL
from twin.build.full_model import assemble
from twin.build.simulate import simulate
from twin.inject.experiment import NOISE, START, STEP, TCP_NOISE
from twin.inject.truth.other_films import FILMS
from twin.inject.truth.other_machine import ASIDE, OFF, other_parameters, other_text
from twin.inject.truth.side_by_side import driven, felt_run, truths_of
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.machine.load import load_machine
from twin.rom.drive import evaluate


@pytest.fixture(scope="module")
def pair():
    return load_machine(MODEL / "machine.toml"), load_machine(MODEL / "machine.toml", other_text(EXPERIMENT, 4))


def test_a_seed_gives_one_machine():
    assert other_text(EXPERIMENT, 4) == other_text(EXPERIMENT, 4)
    assert other_text(EXPERIMENT, 4) != other_text(EXPERIMENT, 5)


def test_names_and_wiring_are_those_of_the_shipped_machine(pair):
    shipped, other = pair
    for section in ("parts", "axes", "contacts", "signals", "environment", "sources", "films", "sensors", "supports"):
        assert list(getattr(shipped, section)) == list(getattr(other, section))
    for name, film in shipped.films.items():
        assert other.films[name].surfaces == film.surfaces
        assert other.films[name].environment == film.environment


def test_films_follow_other_laws(pair):
    shipped, other = pair
    assert set(FILMS) == set(shipped.films)
    for name, film in other.films.items():
        law, values = film.law, dict(film.parameters)
        assert (law, values) != (shipped.films[name].law, dict(shipped.films[name].parameters))


def test_sensors_sit_some_millimetres_aside(pair):
    shipped, other = pair
    gaps = [
        np.linalg.norm(np.subtract(other.sensors[name].position, sensor.position))
        for name, sensor in shipped.sensors.items()
        if sensor.position is not None
    ]
    assert max(gaps) < ASIDE + 1e-4
    assert np.mean(gaps) > ASIDE / 2


def test_parameters_are_off_by_their_half_widths():
    factors: dict[str, list[float]] = {kind: [] for kind in OFF}
    for p, value in other_parameters(EXPERIMENT, 4).values():
        if p.kind in OFF:
            gain = FILMS[p.path.split(".")[1]].gain if p.kind == "film" else 1.0
            factors[p.kind].append(value / p.nominal / gain)
    for kind, found in factors.items():
        off = np.abs(np.array(found) - 1.0)
        assert off.max() <= OFF[kind] + 1e-4, kind
        assert off.max() > 0.1 * OFF[kind], kind


def test_work_before_the_start_and_what_is_not_logged():
    run = read_run(MODEL / "runs" / "diagnosis_1")
    extra = {"hidden_1": np.linspace(0.0, 1.0, len(run.loads.time))}
    felt, ahead = felt_run(run, extra, 1.5)
    assert ahead == 5400.0
    assert np.all(np.diff(felt.loads.time) == 60.0)
    assert felt.loads.units["hidden_1"] == "1"
    np.testing.assert_array_equal(felt.loads.columns["hidden_1"][90:], extra["hidden_1"])
    np.testing.assert_array_equal(felt.loads.columns["x_speed"][:90], run.loads.columns["x_speed"][:90])
    same, late = felt_run(run, {}, 0.0)
    assert late == 0.0
    np.testing.assert_array_equal(same.loads.time, run.loads.time)


@pytest.mark.slow
def test_runs_side_by_side_are_those_one_after_the_other():
    """A minute is one step of second order there; against eight Euler steps, on the shipped mesh."""
    full, steps = assemble(EXPERIMENT.machine), 35
    several = [driven(full, run, {}) for run in EXPERIMENT.runs[1:]]
    (found,) = truths_of([full], several, steps)
    load = full.thermal.load_model
    for truth, one, run in zip(found, several, EXPERIMENT.runs[1:], strict=True):
        drive = evaluate(load, run.loads.time, signal_values(run, load.signals), STEP, steps)
        rows = one.when <= drive.time[-1]
        assert rows.any()
        wanted = simulate(full, drive, one.when[rows], one.where[rows], START, 8)
        assert truth.sensors == wanted.sensors
        np.testing.assert_allclose(truth.time, wanted.time)
        error = truth.temperatures - wanted.temperatures
        assert np.sqrt((error**2).mean(axis=0)).max() < NOISE  # of the sensor that sees the spindle start
        assert np.sqrt((error**2).mean()) < 0.25 * NOISE
        assert np.ptp(wanted.temperatures) > 2.0
        np.testing.assert_allclose(truth.tcp[rows], wanted.tcp, atol=TCP_NOISE)
