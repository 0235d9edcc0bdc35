"""The spindle known from measurements alone; the measured data are no part of the project, their tests skip without."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from models.measured import VARIABLE, measured_data
from models.scripts import load_script
from twin.calibrate.score.compare import channels
from twin.cli.main import run
from twin.logs.read import read_run
from twin.machine.load import load_machine
from twin.rom.artefact import read_artefact
from twin.run.replay import replay

FOLDER = Path(__file__).parents[2] / "models" / "spindle_drift"
HOUR = 3600.0

script = partial(load_script, FOLDER)


@pytest.fixture(scope="module")
def data() -> Path:
    found = measured_data("spindle_drift")
    if found is None:
        pytest.skip(f"no measured data; {VARIABLE} names their folder")
    return found / "warmup"


def recording(folder: Path, hours: float, late: float = 0.0) -> Path:
    """Files like the measured ones, a row every 10 min; displacements `late` [s] beside the loads."""
    time = np.arange(0.0, hours * HOUR + 1.0, 600.0)
    speed = np.where(np.mod(time, 8 * HOUR) < 4 * HOUR, 1250.0 * (1.0 + time // (8 * HOUR)), 0.0)
    tables = {
        "loads.csv": {"time [s]": time, "spindle.speed [1/min]": speed},
        "temperatures.csv": {"time [s]": time} | {f"t{i} [degC]": 20.0 + i + 0.1 * time / HOUR for i in range(1, 17)},
        "displacement.csv": {"time [s]": time + late} | {f"ch{i} [um]": i + time / HOUR for i in range(1, 6)},
    }
    folder.mkdir(exist_ok=True)
    for name, columns in tables.items():
        header, values = ",".join(columns), np.column_stack(list(columns.values()))
        np.savetxt(folder / name, values, delimiter=",", header=header, comments="", fmt="%.6f")
    return folder


def test_check_finds_nothing(capsys):
    assert run(["check", "--json", str(FOLDER)]) == 0
    assert json.loads(capsys.readouterr().out)["problems"] == []


def test_the_synthetic_run_is_what_make_runs_writes(tmp_path):
    script("runs/make_runs.py").write_warm_up(tmp_path)
    for file in ("loads.csv", "run.toml"):
        assert (tmp_path / file).read_text() == (FOLDER / "runs" / "warm_up" / file).read_text()


def test_a_handful_of_nodes_whose_expansions_are_all_to_be_found():
    machine = load_machine(FOLDER)
    assert len(machine.nodes) == 6
    assert all(component == 0.0 for row in machine.tcp.expansion.values() for component in row)
    assert {e.signal for e in machine.environment.values()} == {"t1", "t4", "t11"}


def test_training_ends_where_sealed_rows_begin(tmp_path):
    make_runs = script("runs/make_runs.py")
    make_runs.write_runs(recording(tmp_path / "data", 30.0), tmp_path / "runs")
    training, sealed = (read_run(tmp_path / "runs" / name) for name in ("training", "sealed"))
    assert training.tcp is not None
    assert sealed.tcp is not None
    assert training.tcp.time[-1] == training.loads.time[-1] == 24 * HOUR
    assert sealed.tcp.time[0] == sealed.loads.time[0] == 0.0  # the machine's memory, and the reference
    assert sealed.tcp.time[1] > 24 * HOUR
    assert training.tcp_reference == sealed.tcp_reference == "first"
    np.testing.assert_allclose(sealed.tcp.displacement[1:, 1], 1e-6 * (3.0 + sealed.tcp.time[1:] / HOUR), atol=1e-10)
    assert sealed.tcp.sigma is None
    assert training.initial_temperature == pytest.approx(21.0)
    turning = training.loads.columns["running"] > 0.0
    np.testing.assert_array_equal(turning, training.loads.columns["spindle_speed"] > 0.0)


def test_recordings_that_cannot_be_split_or_matched_are_refused(tmp_path):
    make_runs = script("runs/make_runs.py")
    with pytest.raises(ValueError, match="nothing is left to be sealed"):
        make_runs.write_runs(recording(tmp_path / "short", 20.0), tmp_path / "runs")
    with pytest.raises(ValueError, match="not on one clock"):
        make_runs.write_runs(recording(tmp_path / "late", 30.0, late=15.0), tmp_path / "runs")


def test_measured_data_are_found_where_the_variable_says(tmp_path, monkeypatch):
    (tmp_path / "spindle_drift").mkdir()
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    assert measured_data("spindle_drift") == tmp_path / "spindle_drift"
    assert measured_data("another") is None


@pytest.mark.parametrize("lag", [0.4, 2.5])
def test_lags_of_the_baselines_answer_a_step(lag):
    hour = np.arange(0.0, 6.0, 15.0 / HOUR)
    step = np.where(hour >= 1.0, 1.0, 0.0)
    expected = np.where(hour >= 1.0, 1.0 - np.exp(-(hour - 1.0) / lag), 0.0)
    np.testing.assert_allclose(script("baselines.py").lagged(step, hour, lag), expected, atol=2e-3)


@pytest.mark.slow
def test_baselines_do_not_see_what_they_are_scored_on(data):
    """Displacements after training are replaced by noise: not one prediction changes."""
    baselines = script("baselines.py")
    table = baselines.recording(data)
    rng, late = np.random.default_rng(3), table.hour > 24.0
    noise = {c: np.where(late, rng.normal(size=len(late)), y) for c, y in table.channels.items()}
    blind = type(table)(table.hour, table.speed, table.sensors, noise)
    for a, b in zip(baselines.baselines(table), baselines.baselines(blind), strict=True):
        for c in baselines.CHANNELS:
            np.testing.assert_array_equal(a.predicted[c], b.predicted[c])


@pytest.mark.slow
def test_the_fourth_speed_is_predicted_from_three(data, tmp_path):
    """Calibrated on hours 0 to 24, scored on the rest: rms [um] of dx, dy, dz, whose ranges there are 23, 71, 37."""
    script("runs/make_runs.py").write_runs(data, tmp_path)
    rough, fitted = str(tmp_path / "rough.h5"), str(tmp_path / "calibrated.h5")
    assert run(["build", str(FOLDER), "-o", rough]) == 0
    assert run(["calibrate", rough, str(tmp_path / "training"), "-o", fitted, "--iterations", "100"]) == 0
    artefact, sealed = read_artefact(Path(fitted)), read_run(tmp_path / "sealed")
    found = [c for c in channels(artefact, sealed, replay(artefact, sealed)) if c.kind == "tcp"]
    rms = [1e6 * np.sqrt(np.mean((c.simulated - c.measured) ** 2)) for c in found]
    assert [c.name for c in found] == ["dx", "dy", "dz"]
    assert rms[0] < 1.9  # the best of ten baselines, chosen with hindsight
    assert rms[1] < 4.5  # one of them is better: 1.9
    assert rms[2] < 4.8  # likewise: 3.0
