"""Every command on a thermal problem: a plate without TCP, supports, expansion and elastic constants."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.spatial import cKDTree

import twin
from tests.support.descriptions import MACHINES
from twin.build.full_model import assemble
from twin.build.pipeline import BuildOptions
from twin.build.product import build_artefact
from twin.build.stepper import CoupledStepper
from twin.cli.main import run
from twin.errors import TwinError
from twin.logs.read import read_run
from twin.machine.load import load_machine
from twin.rom.artefact import read_artefact
from twin.rom.drive import evaluate

PLATE = next(path.parent for path in MACHINES if path.parent.name == "plate")
HEATING = PLATE / "runs" / "heating"
QUICK = BuildOptions(held_out=3, hours=1.0)


@pytest.fixture(scope="module")
def artefact(tmp_path_factory):
    path = tmp_path_factory.mktemp("plate") / "plate.h5"
    assert run(["build", str(PLATE), "-o", str(path)]) == 0
    return path


@pytest.fixture(scope="module")
def result(artefact, tmp_path_factory):
    folder = tmp_path_factory.mktemp("plate_result") / "out"
    assert run(["run", str(artefact), str(HEATING), "-o", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """What a plate with three quarters of the heat exchange measures."""
    folder = tmp_path_factory.mktemp("plate_measured")
    text = (PLATE / "machine.toml").read_text(encoding="utf-8")
    (folder / "machine.toml").write_text(text.replace('natural = "10 W', 'natural = "7.5 W'), encoding="utf-8")
    noise = ("--noise", "0.02 K")
    assert run(["simulate", str(folder), str(HEATING), "-o", str(folder / "run"), *noise]) == 0
    return folder / "run"


def test_check_finds_nothing_wrong(capsys):
    assert run(["check", str(PLATE)]) == 0
    assert run(["check", str(HEATING)]) == 0
    assert capsys.readouterr().out.count("no problems found") == 2


def test_a_machine_of_which_nothing_is_read_is_refused(tmp_path, capsys):
    text = (PLATE / "machine.toml").read_text(encoding="utf-8")
    (tmp_path / "machine.toml").write_text(text[: text.index("[sensors.bottom]")], encoding="utf-8")
    for command in (["check", str(tmp_path)], ["build", str(tmp_path), "-o", str(tmp_path / "a.h5")]):
        assert run(command) == 2
        assert "nothing is watched" in "".join(capsys.readouterr())
    assert [p.name for p in tmp_path.iterdir()] == ["machine.toml"]


@pytest.mark.long
def test_verify_speaks_of_temperatures_alone(artefact, tmp_path, capsys):
    path = Path(shutil.copy(artefact, tmp_path))
    assert run(["verify", str(path)]) == 0
    told = capsys.readouterr().out
    assert "rich basis" in told
    assert "TCP" not in told
    assert " um" not in told
    assert read_artefact(path).certificate["passed"]


@pytest.mark.long
def test_temperatures_are_within_20_mk_of_the_converged_ones_everywhere(tmp_path):
    """On all the surface, in each of the first 120 minutes, against elements and steps half and a quarter as large."""
    path = tmp_path / "plate.h5"
    build_artefact(PLATE, path, QUICK)
    result = twin.run(twin.read(path), HEATING)
    (field,) = read_artefact(path).fields
    machine = load_machine(PLATE)
    part = machine.parts["plate"]
    finer = part.model_copy(update={"box": part.box.model_copy(update={"divisions": (6, 12, 4)})})
    full = assemble(machine.model_copy(update={"parts": {"plate": finer}}))
    drive = evaluate(full.thermal.load_model, read_run(HEATING).loads.time, {}, 60.0, n_steps=120)
    distance, at = cKDTree(full.bodies[0].nodes).query(field.nodes)
    assert distance.max() < 1e-9
    stepper = CoupledStepper(full.thermal)
    worst = [
        abs(field.basis @ result.numbers.states[step + 1] - x[0][at]).max()
        for step, x, _ in stepper.run(drive, stepper.uniform(20.0), substeps=4)
    ]
    assert len(worst) == 120
    assert max(worst) < 0.02
    assert result.temperatures.sel(sensor="bottom").values[-1] > 160.0
    with pytest.raises(TwinError, match="no temperature moves the tool"):
        result.plot.tcp()


@pytest.mark.long
def test_run_writes_no_displacements(result, artefact, tmp_path, capsys):
    assert {p.name for p in result.iterdir()} >= {"result.h5", "temperatures.csv", "summary.json"}
    assert not (result / "tcp.csv").exists()
    told = json.loads((result / "summary.json").read_text(encoding="utf-8"))
    assert told["tcp"] is None
    assert told["heat"]["max_balance_error"] < 1e-10
    with h5py.File(result / "result.h5") as f:
        # the balance of the whole plate, film on 0.65 m^2: C dT/dt = P - h A (T - T_air), within the 3 K across it
        T, t = f["temperature"][:].mean(axis=1), f["time"][:]
        expected = 20.0 + 1000.0 / 6.5 * (1.0 - np.exp(-6.5 * t / 100_000.0))
        assert abs(T - expected).max() < 0.05 * expected.max()
    folder = shutil.copytree(result, tmp_path / "out")
    assert run(["report", str(artefact), str(folder)]) == 0
    assert {p.stem for p in folder.glob("*.png")} == {"temperatures", "surface"}
    page = (folder / "index.html").read_text(encoding="utf-8")
    assert "the description has no [tcp.tool]" in page
    assert "tcp.csv" not in page
    capsys.readouterr()
    assert run(["warmup", str(result)]) == 0
    assert "the TCP never moves; 0 of 3 sensors settled" in capsys.readouterr().out
    assert run(["info", str(artefact)]) == 0


@pytest.mark.long
def test_verbs_that_need_a_tcp_say_so(artefact, result, measured, tmp_path, capsys):
    for command in (
        ["correction", str(artefact), str(result), "-o", str(tmp_path / "c.json")],
        ["update", str(artefact), str(measured)],
        ["rtest", str(measured), "--artefact", str(artefact)],
        ["poses", str(PLATE), str(HEATING)],
    ):
        assert run(command) == 2
        told = capsys.readouterr().err
        assert "no temperature moves the tool" in told
        assert "describe its TCP" in told


@pytest.mark.long
def test_measurements_hold_temperatures_alone_and_correct_the_film(artefact, measured, tmp_path, capsys):
    log = read_run(measured)
    assert log.tcp is None
    assert set(log.synthetic) == {"loads", "temperatures"}
    path = tmp_path / "calibrated.h5"
    assert run(["calibrate", str(artefact), str(measured), "-o", str(path), "--only", "films.*"]) == 0
    assert read_artefact(path).model.load_model.films[0].gain == pytest.approx(0.75, abs=0.01)
    capsys.readouterr()
    assert run(["score", str(path), str(measured), "--json"]) == 0
    assert run(["verify", str(path)]) == 0


@pytest.mark.slow
def test_diagnosis_finds_a_second_heater(artefact, tmp_path):
    text = (PLATE / "machine.toml").read_text(encoding="utf-8")
    heater = '[sources.second]\nlaw = "constant_heat"\nsurface = "plate.x_max"\nparameters = { power = "800 W" }\n'
    (tmp_path / "machine.toml").write_text(text + heater, encoding="utf-8")
    noise = ("--noise", "0.05 K")
    assert run(["simulate", str(tmp_path), str(HEATING), "-o", str(tmp_path / "run"), *noise]) == 0
    few = ("--nulls", "20")
    assert run(["diagnose", str(artefact), str(tmp_path / "run"), "-o", str(tmp_path / "out"), *few]) == 0
    report = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    (cause,) = report["causes"]
    assert (report["verdict"], cause["family"], cause["place"]) == ("named", "heat_source", "plate.x_max")
    low, high = cause["ci95"]
    assert low < 800.0 < high
