"""The main job on the small machine, through the command line: build, verify, simulate, run, info."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest

from tests.system.conftest import SLIDE
from twin.build.pipeline import full_model
from twin.build.scenario import draw
from twin.build.stepper import CoupledStepper, sensor_temperatures, tcp_at_poses
from twin.cli.main import run
from twin.logs.read import read_run
from twin.machine.load import load_machine
from twin.rom.artefact import read_artefact
from twin.run.replay import replay_drive


@pytest.mark.long
def test_verify_passes_and_stores_the_certificate(built_artefact, tmp_path):
    path = tmp_path / "slide.h5"
    shutil.copy(built_artefact, path)
    assert [p["name"] for p in read_artefact(path).certificate["parts"]] == ["reduction", "time step", "poses"]
    assert run(["verify", str(path)]) == 0
    stored = read_artefact(path).certificate
    assert len(stored["scenarios"]) == 19
    assert len(stored["full_scenarios"]) == 2
    parts = {p["name"]: np.max(p["temperature_error_in_case"]) for p in stored["parts"]}
    assert 0 < parts["rich basis"] < stored["limit_temperature"] / 2
    assert 0 < parts["time step"] < stored["limit_temperature"]
    assert np.shape(stored["displacement_error_at_positions"]) == (20, 3)
    assert stored["step_halved"] < 0.2  # the reference's own step does not count
    assert np.max(stored["temperature_error_in_case"]) <= sum(parts.values())
    assert np.max(stored["temperature_error_in_case"]) <= stored["limit_temperature"]
    assert stored["worst_relative"] < 0.01


@pytest.mark.slow
def test_verify_fails_with_status_1_when_the_model_is_too_small(tmp_path, capsys):
    path = tmp_path / "small.h5"
    assert run(["build", str(SLIDE / "machine.toml"), "-o", str(path), "--states", "8", "--training", "4"]) == 1
    assert run(["verify", str(path)]) == 1
    assert "FAILED" in capsys.readouterr().out


def test_verify_refuses_another_machine(slide_artefact, tmp_path, capsys):
    other = tmp_path / "machine.toml"
    text = (SLIDE / "machine.toml").read_text(encoding="utf-8")
    other.write_text(text.replace('conductivity = "45 W/(m*K)"', 'conductivity = "46 W/(m*K)"'), encoding="utf-8")
    assert run(["verify", str(slide_artefact), "--machine", str(other)]) == 2
    assert "not the machine" in capsys.readouterr().err


def test_build_refuses_what_check_refuses(tmp_path, capsys):
    machine = tmp_path / "machine.toml"
    text = (SLIDE / "machine.toml").read_text(encoding="utf-8")
    machine.write_text(text.replace('conductivity = "50 W/(m*K)"', 'conductivity = "50 W/(mm*K)"'), encoding="utf-8")
    assert run(["build", str(machine), "-o", str(tmp_path / "a.h5")]) == 2
    assert "off by a factor 1000" in capsys.readouterr().err
    assert run(["build", str(SLIDE), "-o", str(tmp_path)]) == 2
    assert "is a folder" in capsys.readouterr().err
    assert run(["build", str(SLIDE), "-o", str(machine)]) == 2
    assert "would replace an input" in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == ["machine.toml"]


@pytest.mark.parametrize(
    "options",
    [
        ("--dt", "0 s"),
        ("--dt", "-60 s"),
        ("--tcp-every", "0 s"),
        ("--tcp-noise", "-1 um"),
        ("--seed", "-1"),
        ("--size", "0 mm"),
    ],
)
def test_simulate_refuses_numbers_out_of_range(tmp_path, capsys, options):
    short = str(SLIDE / "runs" / "short")
    assert run(["simulate", str(SLIDE), short, "-o", str(tmp_path / "truth"), *options]) == 2
    assert options[0] in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_simulate_never_replaces_the_run_it_reads(tmp_path, capsys):
    folder = tmp_path / "run"
    shutil.copytree(SLIDE / "runs" / "short", folder)
    before = {p.name: p.read_bytes() for p in folder.iterdir()}
    assert run(["simulate", str(SLIDE), str(folder), "-o", f"{folder}/../run", "--hours", "0.1"]) == 2
    assert "is the run that is read" in capsys.readouterr().err
    assert {p.name: p.read_bytes() for p in folder.iterdir()} == before


@pytest.mark.long
def test_runtime_equals_the_offline_stepper_on_the_same_model(slide_artefact):
    artefact = read_artefact(slide_artefact)
    model = artefact.model
    scenario = draw(model.load_model, 9003, hours=1.0)
    drive = scenario.drive
    position = drive.position[0]
    result = replay_drive(artefact, drive, position, 4, scenario.start)
    stepper = CoupledStepper(model)
    for step, x, _ in stepper.run(drive, stepper.uniform(scenario.start), substeps=4):
        T = sensor_temperatures(model, x)
        assert np.abs(result.temperature[step + 1, : len(T)] - T).max() < 1e-9
        assert np.abs(result.tcp[step + 1] - tcp_at_poses(model, x)).max() < 1e-14
    assert np.max(result.balance_error) < 1e-8


@pytest.mark.long
def test_simulated_truth_and_reduced_run_agree(built_artefact, tmp_path):
    truth, out = tmp_path / "truth", tmp_path / "out"
    loads = SLIDE / "runs" / "short"
    assert run(["simulate", str(SLIDE), str(loads), "-o", str(truth), "--tcp-every", "5 min"]) == 0
    simulated = read_run(truth)
    assert set(simulated.synthetic) >= {"temperatures", "tcp"}
    assert run(["run", str(built_artefact), str(truth), "-o", str(out)]) == 0
    with h5py.File(out / "result.h5") as f:
        names = [n.decode() if isinstance(n, bytes) else n for n in f["sensor"][:]]
        for name, column in simulated.temperatures.columns.items():
            rise = np.ptp(column)
            assert np.abs(f["temperature"][:, names.index(name)] - column).max() <= 0.002 * 10 + 0.002 * rise
        rows = np.searchsorted(f["time"][:], simulated.tcp.time)
        error = np.abs(f["tcp_actual"][:][rows] - simulated.tcp.displacement).max()
    assert np.ptp(simulated.tcp.displacement) > 1e-6
    assert error < 0.1e-6 + 0.01 * np.ptp(simulated.tcp.displacement)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["heat"]["max_balance_error"] < 1e-8


@pytest.mark.long
def test_noise_is_added_as_asked_and_repeats(tmp_path):
    arguments = ["simulate", str(SLIDE), str(SLIDE / "runs" / "short"), "--noise", "0.1 K"]
    for name, seed in (("a", "3"), ("b", "3"), ("c", "4"), ("clean", None)):
        extra = ["--seed", seed] if seed else ["--noise", "0 K"]
        assert run([*arguments, "-o", str(tmp_path / name), *extra]) == 0
    a, b, c, clean = (read_run(tmp_path / n).temperatures.columns for n in ("a", "b", "c", "clean"))
    noise = np.array([a[k] - clean[k] for k in clean])
    assert abs(noise.std() - 0.1) < 0.02
    assert all(np.array_equal(a[k], b[k]) for k in a)
    assert not any(np.array_equal(a[k], c[k]) for k in a)


@pytest.mark.slow
def test_equal_input_gives_an_equal_file(built_artefact, tmp_path, monkeypatch):
    monkeypatch.setenv("TWIN_CACHE", str(tmp_path / "cache"))  # nothing of the first build may help the second
    again = tmp_path / "again.h5"
    assert run(["build", str(SLIDE / "machine.toml"), "-o", str(again), "--states", "150"]) == 0
    contents = []
    for path in (built_artefact, again):
        content = path.read_bytes()
        with h5py.File(path) as f:
            for told in ("created", "content_sha256"):
                value = f.attrs[told]
                written = value if isinstance(value, bytes) else value.encode()
                content = content.replace(written, b"x" * len(written))
        contents.append(content[: content.rindex(b"twin sha256")])
    assert contents[0] == contents[1]


@pytest.mark.parametrize(
    "stage", ["rich basis", *(pytest.param(s, marks=pytest.mark.slow) for s in ("meshes", "compact against rich"))]
)
@pytest.mark.long
def test_interrupted_build_leaves_nothing_and_can_be_repeated(tmp_path, stage):
    target = tmp_path / "slide.h5"
    small = ["--states", "40", "--training", "4"]
    command = [sys.executable, "-u", "-m", "twin.cli.main", "build", str(SLIDE), "-o", str(target), *small]
    environment = os.environ | {"TWIN_CACHE": str(tmp_path / "cache")}
    process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    for line in process.stdout:
        if line.startswith(stage):
            process.send_signal(signal.SIGINT)
            break
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert "Traceback" not in err
    assert list(tmp_path.glob("*.h5")) == []
    assert list(tmp_path.rglob("*.part")) == []


@pytest.mark.long
def test_stages_of_an_interrupted_build_are_not_made_again(tmp_path, monkeypatch):
    monkeypatch.setenv("TWIN_CACHE", str(tmp_path))
    machine = load_machine(SLIDE)
    began = time.perf_counter()
    made = full_model(machine)
    first = time.perf_counter() - began
    began = time.perf_counter()
    again = full_model(machine)
    assert time.perf_counter() - began < first / 2
    assert np.array_equal(made.thermal.bodies[0].G, again.thermal.bodies[0].G)
    (entry,) = tmp_path.glob("full-*.npz")
    entry.write_bytes(entry.read_bytes()[:1000])  # torn: made again, not trusted
    assert np.array_equal(made.thermal.bodies[0].G, full_model(machine).thermal.bodies[0].G)


def test_full_model_closes_its_heat_balance_at_every_position():
    machine = load_machine(SLIDE)
    model = full_model(machine).thermal
    drive = draw(model.load_model, 5, hours=0.5).drive
    stepper = CoupledStepper(model)
    x = stepper.uniform(20.0)
    for _, _, heat in stepper.run(drive, x, substeps=2):
        assert heat.balance_error < 1e-8


def test_a_build_does_not_replace_what_is_no_artefact(tmp_path, capsys):
    notes = tmp_path / "notes.md"
    notes.write_text("mine")
    assert run(["build", str(SLIDE), "-o", str(notes)]) == 2
    assert "is no artefact" in capsys.readouterr().err
    assert notes.read_text() == "mine"


def test_simulate_does_not_go_on_beyond_the_log(tmp_path, capsys):
    log = SLIDE / "runs" / "short"
    assert run(["simulate", str(SLIDE), str(log), "-o", str(tmp_path / "truth"), "--hours", "900"]) == 2
    assert "the log covers" in capsys.readouterr().err
    assert not (tmp_path / "truth").exists()
