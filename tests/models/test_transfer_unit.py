"""The rotary transfer unit of paper 002: what the paper reports, on our machine."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from models.scripts import load_script
from twin.build.mesh import load_body_meshes
from twin.build.stepper import CoupledStepper, sensor_temperatures
from twin.build.thermal import assemble_thermal
from twin.cli.main import run
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.machine.description import Machine
from twin.machine.load import load_machine
from twin.rom.drive import evaluate
from twin.rom.model import MachineModel

FOLDER = Path(__file__).parents[2] / "models" / "transfer_unit"
RUNS = ("passive", "warmup", "validation", "working_day")


script = partial(load_script, FOLDER)


@pytest.fixture(scope="module")
def machine() -> Machine:
    return load_machine(FOLDER)


@pytest.fixture(scope="module")
def thermal(machine) -> MachineModel:
    return assemble_thermal(machine, load_body_meshes(machine))


@pytest.mark.parametrize("path", [FOLDER, *(FOLDER / "runs" / name for name in RUNS)], ids=lambda p: p.name)
def test_check_finds_nothing_but_an_idle_machine(path, capsys):
    assert run(["check", "--json", str(path)]) == 0
    problems = json.loads(capsys.readouterr().out)["problems"]
    silent = [p for p in problems if "zero throughout" in p["what"]]
    assert problems == silent
    assert bool(silent) == (path.name == "passive")


@pytest.mark.parametrize("name", RUNS)
def test_runs_are_what_make_runs_writes(name, tmp_path):
    make_runs = script("runs/make_runs.py")
    make_runs.write(tmp_path / name, make_runs.SCENARIOS[name])
    for file in ("loads.csv", "run.toml"):
        assert (tmp_path / name / file).read_text() == (FOLDER / "runs" / name / file).read_text()


def test_numbers_of_the_paper(machine):
    """Section 2.3: preload of the nuts 683.6 N, roller guides 4e-4, f0r 2, f1r 2.5e-4; eta 0.9617."""
    nut, guide, bearing = (machine.sources[name].parameters for name in ("z_nut", "z_guide", "spindle_bearing"))
    assert (nut["preload"], nut["diameter"], nut["lead"], nut["friction"]) == ("683.6 N", "25 mm", "10 mm", 0.005)
    assert (guide["friction"], guide["preload_class"]) == (4e-4, 0.13)
    assert (bearing["f0"], bearing["f1"]) == (2.0, 2.5e-4)
    expansions = {machine.materials[part.material].expansion for part in machine.parts.values()}
    assert expansions == {10e-6, 11.7e-6, 23e-6}  # cast iron, steel, aluminium


def test_one_capacity_explained_by_a_film_alone_and_with_the_source():
    """E-002-10: h alone runs to its bound of 60 and leaves about 2.45 K; with the source 6 and 150 come back."""
    alone, both = script("explain_h.py").explain_lumped()
    assert alone.h == pytest.approx(60.0)
    assert alone.rms == pytest.approx(2.45, abs=0.1)
    assert both.h == pytest.approx(6.0, abs=0.1)
    assert both.power == pytest.approx(150.0, abs=3.0)
    assert both.rms < 0.06


@pytest.mark.parametrize(("passive", "dynamic"), [(True, True), (True, False), (False, True), (False, False)])
@pytest.mark.long
def test_groups_of_sources_are_switched_and_heat_balances(thermal, passive, dynamic):
    """Full model, ten minutes of the part program: every step closes to 1e-8, what is off gives nothing."""
    groups = script("heat_groups.py")
    load = groups.switched(thermal.load_model, passive, dynamic)
    model = replace(thermal, load_model=load)
    log = read_run(FOLDER / "runs" / "validation")
    drive = evaluate(load, log.loads.time, signal_values(log, load.signals), 120.0, 5)
    stepper = CoupledStepper(model)
    heats = [heat for _, _, heat in stepper.run(drive, stepper.uniform(21.0), 1)]
    assert max(h.balance_error for h in heats) < 1e-8
    power = dict(zip((s.name for s in load.sources), np.mean([h.power for h in heats], axis=0), strict=True))
    assert power.pop("electronics") == (pytest.approx(30.0) if passive else 0.0)
    assert all((p > 0.3) == dynamic for p in power.values()), power
    assert set().union(*groups.ZONES.values()) == {f.name for f in load.films}


def rise(model: MachineModel, change: float) -> np.ndarray:
    """Sensors after 2 h of air that is warmer by `change` [K] than the machine, without sources."""
    load = script("heat_groups.py").switched(model.load_model, False, False)
    log = read_run(FOLDER / "runs" / "passive")
    signals = signal_values(log, load.signals)
    signals |= {name: np.full_like(signals[name], 20.0 + change) for name in ("room", "cabin")}
    drive = evaluate(load, log.loads.time, signals, 1200.0, 6)
    stepper = CoupledStepper(replace(model, load_model=load))
    for _, x, _ in stepper.run(drive, stepper.uniform(20.0), 1):
        last = x
    return sensor_temperatures(model, last) - 20.0


@pytest.mark.long
def test_three_kelvin_and_fifteen(machine, thermal):
    """Paper 002 extrapolates 3 K to 15 K and finds "linear behaviour": exact for constant films, a tautology
    (E-002-14); free convection and radiation warm the machine faster at 15 K."""
    constant = {"law": "constant_film", "parameters": {"natural": 6.0}, "emissivity": 0.0, "signals": {}}
    films = {name: film.model_copy(update=constant) for name, film in machine.films.items()}
    changed = machine.model_copy(update={"films": films})
    linear = assemble_thermal(changed, load_body_meshes(changed))
    np.testing.assert_allclose(rise(linear, 15.0), 5.0 * rise(linear, 3.0), rtol=1e-9)
    more = rise(thermal, 15.0) / (5.0 * rise(thermal, 3.0))
    assert more.min() > 1.02
    assert more.max() < 1.5


@pytest.fixture(scope="module")
def artefact(tmp_path_factory):
    path = tmp_path_factory.mktemp("transfer_unit") / "transfer_unit.h5"
    assert run(["build", str(FOLDER), "-o", str(path)]) == 0
    return path


@pytest.fixture(scope="module")
def working_day(artefact):
    """Passive and dynamic sources together and alone over the working day."""
    from twin.rom.artefact import read_artefact

    return script("heat_groups.py").results(read_artefact(artefact), read_run(FOLDER / "runs" / "working_day"))


@pytest.mark.slow
def test_the_built_artefact_passes_verification(artefact, capsys):
    assert run(["verify", str(artefact)]) == 0
    assert "passed" in capsys.readouterr().out


@pytest.mark.slow
def test_axial_comes_back_radial_grows(working_day):
    """Paper 002, Figs. 17 and 18, at the middle pose: z is axial (vertical spindle), x radial."""
    result = working_day["both"]
    w = 1e6 * script("heat_groups.py").middle_displacement(result)
    hours = (result.time - result.time[0]) / 3600.0
    x, z = w[:, 0], w[:, 2]
    peak = np.abs(z).argmax()
    assert 0.5 < hours[peak] < 3.0
    assert z[peak] < -6.0
    assert abs(z[-1]) < 0.3 * abs(z[peak])
    assert abs(z[hours > 7.0].mean()) < 0.25 * abs(z[peak])
    every_hour = x[[int(np.abs(hours - h).argmin()) for h in range(9)]]
    assert np.all(np.diff(every_hour) < -3.0)  # towards the table, hour by hour
    assert x[-1] < -80.0
    assert abs(x[-1]) > 10.0 * abs(z[-1])


@pytest.mark.slow
def test_groups_over_the_working_day(working_day):
    groups = script("heat_groups.py")
    heats = {name: groups.heat(result) for name, result in working_day.items()}
    for result in working_day.values():
        assert result.balance_error.max() < 1e-8
        assert not result.flags.any()
    for h in heats.values():
        total = sum(q for name, q in h.items() if name != "stored")
        assert total == pytest.approx(h["stored"], abs=1e-8 * (h["passive sources"] + h["dynamic sources"]))
    assert heats["passive"]["dynamic sources"] == 0.0 < heats["dynamic"]["dynamic sources"]
    assert heats["dynamic"]["passive sources"] == 0.0 < heats["passive"]["passive sources"]
    x = {name: groups.middle_displacement(result)[-1, 0] for name, result in working_day.items()}
    assert abs(x["dynamic"]) > 3.0 * abs(x["passive"])  # radial: mostly the unit's own heat
    assert x["both"] == pytest.approx(x["passive"] + x["dynamic"], rel=0.1)  # films couple them a little


@pytest.mark.slow
def test_the_unit_is_not_warm_after_140_minutes(artefact, tmp_path, capsys):
    """The paper calls 140 min warm; TD4 has done most of its rise then, the TCP drifts on."""
    assert run(["run", str(artefact), str(FOLDER / "runs" / "validation"), "-o", str(tmp_path)]) == 0
    capsys.readouterr()
    assert run(["warmup", str(tmp_path), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert not told["settled"]
    assert told["tcp_worst"]["dx"]["time_s"] is None
    assert told["tcp_worst"]["dx"]["end_rate_m_per_s"] * 3.6e9 < -10.0
    motor = told["sensors"]["TD4"]
    assert 5.0 < motor["change_K"] < 20.0
    assert motor["t63_s"] < 0.5 * told["duration_s"]


@pytest.mark.slow
def test_heated_electronics_look_like_a_large_film(machine):
    """Table 1: the film of the top zone goes from 5 to 25 W/(m^2 K). Alone it leaves ten times what the sensors' noise
    is; with the electronics' heat it is physical and the noise is all that is left."""
    explain_h = script("explain_h.py")
    passive = read_run(FOLDER / "runs" / "passive")
    alone, both = explain_h.explain(machine, passive, (5.0, 6.0, 7.0, 8.0, 10.0, 15.0, 25.0, 40.0, 60.0))
    low, high = explain_h.PHYSICAL
    assert alone.h >= 15.0 > high
    assert low < both.h < high
    assert both.power == pytest.approx(30.0, abs=3.0)
    assert both.rms < 1.3 * explain_h.SIGMA
    assert alone.rms > 5.0 * both.rms
