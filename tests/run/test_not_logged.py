"""A log without the column of a signal that has a default: read, run, simulated and fitted, and flagged once."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.lumped import SPINDLE, edited
from twin.build.pipeline import BuildOptions, rich_model
from twin.build.simulate import simulate_run
from twin.calibrate.fit.problem import Options, problem
from twin.calibrate.score.score import MODEL, VECTOR, score
from twin.errors import LogError
from twin.logs.check import check_run
from twin.logs.read import read_run
from twin.logs.run import Run, Table
from twin.logs.signals import signal_values
from twin.machine.explain import explain, load_of
from twin.machine.load import load_machine
from twin.machine.parameters import parameters
from twin.rom.artefact import Artefact
from twin.run.replay import replay

pytestmark = pytest.mark.long

HEATER = (
    "[signals.shop_air]",
    '[signals.heater]\nunit = "1"\nrange = [0.0, 1.0]\ndefault = 0.25\n\n[sources.heater]\nlaw = "switched_heat"\n'
    'surface = "bed"\nparameters = { power = "3 kW" }\nsignals = { switch = "heater" }\n\n[signals.shop_air]',
)
FLAG = "signals.heater not logged, default 0.25 1 taken"
# also the axis's position has one: it is what results begin at
POSITION = ("range = [-150.0, 350.0]", "range = [-150.0, 350.0]\ndefault = 100")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("heated")
    edited(folder, HEATER, POSITION)
    return folder


@pytest.fixture(scope="module")
def artefact(folder) -> Artefact:
    machine = load_machine(folder)
    model = rich_model(machine, None, BuildOptions().rich)
    return Artefact(model, (folder / "machine.toml").read_text(), {}, {}, (), parameters(machine), "", "spindle")


@pytest.fixture(scope="module")
def run() -> Run:
    """Two hours of the shipped run."""
    return short(read_run(SPINDLE / "runs" / "warm_up"))


def short(run: Run) -> Run:
    kept = run.loads.time <= run.loads.time[0] + 7200.0
    columns = {name: values[kept] for name, values in run.loads.columns.items()}
    return replace(run, loads=replace(run.loads, time=run.loads.time[kept], columns=columns), segments=())


def with_column(run: Run, name: str, values: float, unit: str) -> Run:
    table = run.loads
    columns = {**table.columns, name: np.full(len(table.time), values)}
    return replace(run, loads=replace(table, columns=columns, units={**table.units, name: unit}))


def flags(result) -> dict[str, int]:
    return {name: int(n) for name, n in zip(result.flag_names, result.flags.sum(axis=0), strict=True)}


def test_it_runs_as_if_the_default_were_logged_and_says_so_once(artefact, run):
    without, logged = replay(artefact, run), replay(artefact, with_column(run, "heater", 0.25, "1"))
    np.testing.assert_array_equal(without.states, logged.states)
    assert flags(without)[FLAG] == 1
    assert FLAG not in flags(logged)
    off = replay(artefact, with_column(run, "heater", 0.0, "1"))
    assert np.abs(off.temperature - without.temperature).max() > 0.05


def test_a_position_may_be_missing_too(artefact, run):
    table = run.loads
    rest = {name: values for name, values in table.columns.items() if name != "x_position"}
    result = replay(artefact, replace(run, loads=replace(table, columns=rest, units={n: table.units[n] for n in rest})))
    assert result.position[:, 0] == pytest.approx(0.1)
    assert flags(result)["signals.x_position not logged, default 0.1 m taken"] == 1


def test_check_warns_and_other_signals_are_still_missed(artefact, run):
    told = check_run(run, artefact.model.load_model.signals)
    (one,) = [p for p in told if "heater" in p.what]
    assert one.warning
    assert one.what == "no column 'heater', so its default 0.25 1 is taken"
    bare = replace(run, loads=Table(run.loads.time, {}, {}))
    with pytest.raises(LogError) as e:
        signal_values(bare, artefact.model.load_model.signals)
    assert not any("heater" in p.what for p in e.value.problems)
    assert any("spindle_speed" in p.what for p in e.value.problems)


def test_losses_are_those_of_the_default(folder, run):
    machine = load_machine(folder)
    found = explain(machine, "sources.heater", load_of(machine, {}, run))
    assert found.value == pytest.approx(750.0)
    assert "default: not logged" in found.inputs[0].origin


def test_it_is_simulated_fitted_and_scored(folder, artefact, run):
    simulated, worst = simulate_run(folder, SPINDLE / "runs" / "warm_up", hours=1.0, tcp_every=600.0)
    assert worst < 1e-8
    assert "heater" not in simulated.loads.columns
    own = [p for p in artefact.parameters if p.path in ("sources.heater.gain", "sources.motor.gain")]
    made = problem(artefact, [simulated], own, Options())
    drive = made.runs[0].drive
    assert drive.flags[:, drive.flag_names.index(FLAG)].sum() == 1
    heater = [s.name for s in artefact.model.load_model.sources].index("heater")
    assert drive.power[:, heater] == pytest.approx(750.0)
    scored = score(artefact, [("one", simulated)])
    assert [(r.flagged_steps, r.steps) for r in scored.runs] == [(1, 60)]
    (model,) = [e for e in scored.entries if (e.part, e.run, e.method, e.output) == ("scored", "", MODEL, VECTOR)]
    assert model.figures.rms < 1e-6  # the truth has the same default, worth 8 um; positions lie between poses


def test_a_factor_corrects_what_is_logged(tmp_path, run):
    edited(tmp_path, HEATER, ('unit = "A"\nkind = "rms"', 'unit = "A"\nkind = "rms"\nfactor = 1.2'))
    machine = load_machine(tmp_path)
    plain, corrected = (load_of(load_machine(m), {}, run) for m in (SPINDLE, machine.folder))
    np.testing.assert_allclose(corrected.signals["spindle_current"], 1.2 * plain.signals["spindle_current"])
    assert corrected.signals["heater"] == pytest.approx(0.25)  # a default is the value itself
