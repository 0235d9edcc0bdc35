"""Truths of hidden-effect trials: what is stored is what comes back, and the runs are what they claim to be."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from models.scripts import load_script
from tests.hidden.trials import EXPERIMENT, MODEL, TRUTH
from twin.inject.experiment import RUNS, plan
from twin.inject.stored.files import RESOLUTION, TCP_RESOLUTION, Truth, measured
from twin.inject.stored.files import read as read_truths
from twin.inject.stored.files import write as write_truths
from twin.logs.read import read_run
from twin.machine.load import load_machine

LARGEST = 60_000  # bytes of a stored trial


def made_up(run: str, seed: int) -> Truth:
    rng = np.random.default_rng(seed)
    loads = read_run(MODEL / "runs" / run)
    when, where = plan(loads)
    time = loads.loads.time
    temperatures = 22.0 + 0.02 * np.cumsum(rng.standard_normal((len(time), 4)), axis=0)
    return Truth(run, time, temperatures, ("a", "b", "c", "air"), when, where, 3e-5 * rng.standard_normal((72, 3)))


@pytest.mark.parametrize("run", RUNS)
def test_tcp_is_measured_where_the_log_has_the_axes(run: str):
    found = read_run(MODEL / "runs" / run)
    when, where = plan(found)
    assert len(when) == 3 * 24
    assert np.all(np.isin(when, found.loads.time))
    assert len(np.unique(where, axis=0)) == 3
    assert np.ptp(where, axis=0).min() > 0.5
    rows = np.searchsorted(found.loads.time, when) - 1  # a row holds means over the minute that it starts
    for name in ("x_speed", "y_speed", "z_speed", "spindle_speed"):  # at rest meanwhile
        assert np.all(found.loads.columns[name][rows] == 0.0)


@pytest.mark.parametrize("run", RUNS[:2])
def test_every_drive_works_alone_and_everything_rests(run: str):
    speed = read_run(MODEL / "runs" / run).loads.columns
    drives = np.column_stack([speed[f"{d}_speed"] for d in ("x", "y", "z", "spindle")]) > 0.0
    for k in range(4):
        alone = drives[:, k] & ~np.delete(drives, k, axis=1).any(axis=1)
        assert alone.sum() > 20, f"drive {k}"  # minutes
    still = ~drives.any(axis=1)
    longest = max(len(piece) for piece in "".join("1" if s else "0" for s in still).split("0"))
    assert longest > 35


@pytest.mark.parametrize("run", RUNS)
def test_heats_are_not_collinear(run: str):
    columns = read_run(MODEL / "runs" / run).loads.columns
    speeds = [columns[f"{d}_speed"] for d in ("x", "y", "z", "spindle")]
    squares = [columns[f"{d}_current"] ** 2 for d in ("x", "y", "z", "spindle")]
    r = np.corrcoef(np.array([*speeds, *squares]))
    assert np.abs(r - np.eye(8)).max() < 0.95


@pytest.mark.parametrize("run", RUNS)
def test_loads_lie_within_what_the_description_certifies(run: str):
    signals = load_machine(MODEL / "machine.toml").signals
    loads = read_run(MODEL / "runs" / run).loads
    to_si = {"mm": 1e-3, "m/min": 1.0 / 60.0, "1/min": 1.0 / 60.0, "deg": np.pi / 180.0}
    for name, signal in signals.items():
        low, high = (v * to_si.get(signal.unit, 1.0) for v in signal.range)
        values = loads.columns[name]
        assert low - 1e-9 <= values.min(), name
        assert values.max() <= high + 1e-9, name


@pytest.mark.long
def test_the_script_writes_the_loads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(MODEL / "runs"))
    monkeypatch.delitem(sys.modules, "make_runs", raising=False)
    script = load_script(MODEL, "runs/make_diagnosis.py")
    monkeypatch.delitem(sys.modules, "make_runs")  # other models have scripts of that name
    day = script.DAYS[-1]
    text = script.table(script.thinned(script.log_of(day)))
    assert text == (MODEL / "runs" / day.name / "loads.csv").read_text(encoding="utf-8")


def test_what_is_stored_comes_back(tmp_path: Path):
    truths = [made_up(run, k) for k, run in enumerate(RUNS)]
    path = tmp_path / "new" / "trial.npz"
    write_truths(path, truths, {"family": "film_gain", "amplitude": 1.5})
    found, about = read_truths(EXPERIMENT, path)
    assert about == {"family": "film_gain", "amplitude": 1.5}
    for one, other in zip(truths, found, strict=True):
        assert other.run == one.run
        assert other.sensors == one.sensors
        np.testing.assert_allclose(other.time, one.time)
        np.testing.assert_allclose(other.temperatures, one.temperatures, atol=0.51 * RESOLUTION)
        np.testing.assert_allclose(other.tcp, one.tcp, atol=0.51 * TCP_RESOLUTION)
        np.testing.assert_array_equal(other.positions, one.positions)
    assert path.stat().st_size < LARGEST


def test_what_does_not_fit_is_refused(tmp_path: Path):
    truth = made_up(RUNS[0], 1)
    for lost in (np.nan, 1e-3):  # m
        with pytest.raises(ValueError, match="machine tool"):
            write_truths(tmp_path / "trial.npz", [replace(truth, tcp=truth.tcp + lost)], {})


def test_noise_is_drawn_by_seed_and_run():
    truth = made_up(RUNS[0], 3)
    one, same, other = (measured(EXPERIMENT, truth, seed) for seed in (1, 1, 2))
    assert one.temperatures is not None
    assert same.temperatures is not None
    assert other.temperatures is not None
    noise = one.temperatures.columns["a"] - truth.temperatures[:, 0]
    assert noise.std() == pytest.approx(0.08, rel=0.1)
    np.testing.assert_array_equal(one.temperatures.columns["a"], same.temperatures.columns["a"])
    assert not np.array_equal(one.temperatures.columns["a"], other.temperatures.columns["a"])
    assert one.tcp is not None
    assert (one.tcp.displacement - truth.tcp).std() == pytest.approx(1e-6, rel=0.15)


@pytest.mark.parametrize("name", sorted(path.stem for path in TRUTH.glob("*.npz")))
def test_a_stored_trial_is_small_and_has_the_sensors_of_the_machine(name: str):
    assert (TRUTH / f"{name}.npz").stat().st_size < LARGEST
    truths, about = read_truths(EXPERIMENT, TRUTH / f"{name}.npz")
    runs = [measured(EXPERIMENT, truth, 0) for truth in truths]
    assert [run.folder.name for run in runs] == list(RUNS)
    assert "seed" in about
    for run in runs:
        assert run.temperatures is not None
        assert run.tcp is not None
        assert set(run.temperatures.columns) == set(load_machine(MODEL / "machine.toml").sensors)
        np.testing.assert_array_equal(run.temperatures.time, run.loads.time)
        start = np.array([column[0] for column in run.temperatures.columns.values()])
        if not (about.get("before") or about.get("warm")):
            assert start == pytest.approx(22.0, abs=0.5)
        assert np.abs(run.tcp.displacement).max() < 3e-4
