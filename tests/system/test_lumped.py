"""Every command on a machine without meshes: check, build, verify, info, run, report, simulate, poses, correction."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import h5py
import numpy as np
import pytest

from tests.support.lumped import SPINDLE, edited, film, source, write
from twin.build.full_model import assemble
from twin.build.pipeline import BuildOptions
from twin.build.product import build_artefact, verify_artefact
from twin.build.stepper import CoupledStepper, sensor_temperatures
from twin.cli.main import run
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.machine.load import load_machine
from twin.pictures.placed import described, poses_in_space
from twin.rom.artefact import read_artefact
from twin.rom.drive import evaluate

pytestmark = pytest.mark.long

WARM_UP = SPINDLE / "runs" / "warm_up"
QUICK = BuildOptions(training=6, held_out=3, hours=1.0)
POSES = np.array([[-0.1], [0.2]])


@pytest.fixture(scope="module")
def artefact(tmp_path_factory):
    path = tmp_path_factory.mktemp("spindle") / "spindle.h5"
    assert run(["build", str(SPINDLE), "-o", str(path)]) == 0
    return path


@pytest.fixture(scope="module")
def result(artefact, tmp_path_factory):
    folder = tmp_path_factory.mktemp("spindle_result") / "out"
    assert run(["run", str(artefact), str(WARM_UP), "-o", str(folder)]) == 0
    return folder


def test_check_tells_what_it_consists_of(capsys):
    assert run(["check", str(SPINDLE), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["ok"]
    assert told["facts"] | {"kJ/K": 0} == {
        "name": "spindle", "nodes": 9, "bars": 1, "signals": 6, "bodies": 2, "states": 22, "kJ/K": 0,
    }  # fmt: skip
    assert told["facts"]["kJ/K"] == pytest.approx(228.0, abs=0.1)
    assert run(["check", str(WARM_UP)]) == 0


def test_the_compact_model_is_the_full_one_and_the_certificate_says_so(artefact, tmp_path, capsys):
    path = tmp_path / "spindle.h5"
    shutil.copy(artefact, path)
    assert run(["verify", str(path)]) == 0
    stored = read_artefact(path)
    assert stored.model.n == 22
    assert len(stored.certificate["scenarios"]) == 19
    assert np.max(stored.certificate["temperature_range"]) > 10.0
    parts = {p["name"]: np.max(p["temperature_error_in_case"]) for p in stored.certificate["parts"]}
    assert parts["reduction"] < 1e-9
    assert 0 < parts["rich basis"] < 1e-9
    assert 1e-6 < parts["time step"] <= np.max(stored.certificate["temperature_error_in_case"]) < 0.02
    assert "passed" in capsys.readouterr().out


def test_too_few_states_reduce_it_and_are_certified_as_such(tmp_path):
    path = tmp_path / "small.h5"
    assert not build_artefact(SPINDLE, path, replace(QUICK, states=8)).passed
    stored = read_artefact(path)
    assert stored.model.n == 8
    assert np.max(stored.certificate["temperature_error"]) > 0.02
    assert stored.fields == ()


def test_info_gives_totals_their_unit(artefact, capsys):
    assert run(["info", str(artefact), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["parameters"]["contacts.front_outer.total"] == 14.0
    assert told["parameters"]["contacts.x_screw.conductance"] == 2500.0
    coefficients = told["certified_ranges"]["coefficients"]
    assert coefficients["contacts.front_outer.total"]["unit"] == "W/K"
    assert coefficients["contacts.air_gap.conductance"]["unit"] == "W/(m^2*K)"


def test_run_agrees_with_the_full_model_off_the_grid_of_poses(artefact, result, tmp_path):
    truth = tmp_path / "truth"
    substeps = read_artefact(artefact).certificate["substeps"]
    steps = ("--tcp-every", "5 min", "--substeps", str(substeps))
    assert run(["simulate", str(SPINDLE), str(WARM_UP), "-o", str(truth), *steps]) == 0
    simulated = read_run(truth)
    with h5py.File(result / "result.h5") as f:
        names = [n.decode() for n in f["sensor"][:]]
        for name, column in simulated.temperatures.columns.items():
            assert np.abs(f["temperature"][:, names.index(name)] - column).max() < 1e-3
        rows = np.searchsorted(f["time"][:], simulated.tcp.time)
        error = np.abs(f["tcp_actual"][:][rows] - simulated.tcp.displacement)
        assert f["temperature"][:, names.index("front")].max() > 30.0
    assert np.abs(simulated.tcp.displacement).max() > 20e-6
    assert error.max() < 0.5e-6  # interpolation between five poses; the temperatures are the same
    summary = json.loads((result / "summary.json").read_text())
    assert summary["heat"]["max_balance_error"] < 1e-10
    assert summary["flagged_steps"] == 0


def test_report_draws_what_there_is_and_says_what_there_is_not(artefact, result, tmp_path, capsys):
    folder = shutil.copytree(result, tmp_path / "out")
    assert run(["report", str(artefact), str(folder)]) == 0
    assert {p.stem for p in folder.glob("*.png")} == {"temperatures", "tcp", "workspace"}
    assert "lumped machine: no surface to draw" in (folder / "index.html").read_text(encoding="utf-8")


def test_the_tool_moves_with_the_axis_that_its_nut_rides_on(artefact, tmp_path):
    assert poses_in_space(described(read_artefact(artefact)), ("x",), POSES) == pytest.approx(POSES * [[1, 0, 0]])
    machine = load_machine(edited(tmp_path, ('screw = "tool"', 'screw = "work"')))
    assert poses_in_space(machine, ("x",), POSES) == pytest.approx(-POSES * [[1, 0, 0]])


def test_losses_and_warmup_take_a_lumped_machine(result, capsys):
    assert run(["losses", str(SPINDLE), "--explain", "contacts.front_outer"]) == 0
    assert "14 W/K" in capsys.readouterr().out
    assert run(["losses", str(SPINDLE)]) == 0
    assert "screw_friction" in capsys.readouterr().out
    assert run(["warmup", str(result), "--json"]) == 0


def test_poses_and_correction_take_a_lumped_machine(artefact, result, tmp_path, capsys):
    assert run(["poses", str(SPINDLE), str(WARM_UP), "--random", "50", "--most", "5", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["axes"] == ["x"]
    assert run(["correction", str(artefact), str(result), "-o", str(tmp_path / "c.json")]) == 0


def test_simulate_has_no_mesh_to_refine(tmp_path, capsys):
    assert run(["simulate", str(SPINDLE), str(WARM_UP), "-o", str(tmp_path / "t"), "--size", "10 mm"]) == 2
    assert "a lumped machine has no mesh" in capsys.readouterr().err


def test_an_edited_description_is_another_truth(result, tmp_path):
    """Twin experiments hide an effect in a description: here half the conductance of one contact."""
    path = edited(tmp_path, ('total = "14 W/K"', 'total = "7 W/K"'))
    assert run(["simulate", str(path), str(WARM_UP), "-o", str(tmp_path / "truth")]) == 0
    hidden = read_run(tmp_path / "truth").temperatures.columns["front"]
    with h5py.File(result / "result.h5") as f:
        names = [n.decode() for n in f["sensor"][:]]
        assert (hidden - f["temperature"][:, names.index("front")]).max() > 1.0


def test_a_machine_without_axes_and_tcp(tmp_path, capsys):
    """Temperatures alone: no pose, no displacement; nothing is drawn or told of it."""
    machine = write(
        tmp_path,
        '[nodes.a]\ncapacity = "4 kJ/K"\narea = "0.5 m^2"\n[nodes.b]\ncapacity = "9 kJ/K"\narea = "1 m^2"\n',
        '[contacts.ab]\nkind = "fixed"\nsurfaces = ["a", "b"]\ntotal = "12 W/K"\n',
        film("air", "a b", 8.0),
        source("q", "a"),
        '[sensors.a]\npart = "a"\n',
    )
    assert run(["check", str(machine)]) == 0
    assert "no temperature moves the tool" in capsys.readouterr().out
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "loads.csv").write_text("time [s],current [A]\n" + "".join(f"{60 * i},10\n" for i in range(31)))
    (folder / "run.toml").write_text('sampling = "60 s"\nprovenance = "test"\nsynthetic = ["loads"]\n')
    path, out = tmp_path / "a.h5", tmp_path / "out"
    assert build_artefact(machine, path, QUICK).passed
    assert verify_artefact(path, options=QUICK).passed
    assert run(["run", str(path), str(folder), "-o", str(out)]) == 0
    assert "no temperature moves the tool" in capsys.readouterr().out
    assert run(["report", str(path), str(out)]) == 0
    assert {p.stem for p in out.glob("*.png")} == {"temperatures"}
    full = assemble(load_machine(machine)).thermal
    log = read_run(folder)
    drive = evaluate(full.load_model, log.loads.time, signal_values(log, full.load_model.signals), 60.0)
    stepper = CoupledStepper(full)
    (*_, (_, x, _)) = stepper.run(drive, stepper.uniform(20.0), read_artefact(path).certificate["substeps"])
    with h5py.File(out / "result.h5") as f:
        assert f["temperature"][-1, 0] == pytest.approx(sensor_temperatures(full, x)[0], abs=1e-9)
        assert f["temperature"][-1, 0] > 25.0
