"""Nodes beside parts: states that no contact touches, in the full, the reduced and the stored model."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.descriptions import edited
from twin.build.check_meshes import check_meshes
from twin.build.full_model import FullModel, assemble
from twin.build.pipeline import rich_model
from twin.build.rich_basis import RichOptions
from twin.build.scenario import draw
from twin.build.stepper import CoupledStepper, sensor_temperatures, tcp_at_poses
from twin.calibrate.members.describe import Member, with_members
from twin.calibrate.members.driver import Driver
from twin.calibrate.members.responses import Candidate, responses
from twin.errors import DescriptionError, TwinError
from twin.export.c.write import write_c
from twin.export.options import ExportOptions
from twin.logs.run import Run, Table
from twin.machine.extend import removed
from twin.machine.load import load_machine
from twin.machine.parameters import parameters
from twin.rom.artefact import read_artefact, write_artefact
from twin.rom.drive import evaluate

pytestmark = pytest.mark.long

BEFORE = "[signals.x_position]"
HOLDER = """[nodes.holder]
capacity = "1200 J/K"
area = "0.01 m^2"

[sources.lamp]
law = "constant_heat"
surface = "holder"
parameters = { power = "3 W" }

[films.holder]
law = "constant_film"
surfaces = ["holder"]
environment = "shop"
emissivity = 0.0
parameters = { natural = "100 W/(m^2*K)" }

"""
MOVES = '\n[tcp.expansion]\nholder = ["2 um/K", "0 um/K", "-3 um/K"]\n'
PER_KELVIN = np.array([2e-6, 0.0, -3e-6])
LAG = 1200.0  # s: capacity over area times coefficient


def described(folder, holder=HOLDER, moves=MOVES):
    path = edited(folder, (BEFORE, holder + BEFORE))
    path.write_text(path.read_text(encoding="utf-8") + moves, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    return load_machine(described(tmp_path_factory.mktemp("nodes")))


@pytest.fixture(scope="module")
def full(machine) -> FullModel:
    return assemble(machine)


@pytest.fixture(scope="module")
def bare(tmp_path_factory) -> FullModel:
    return assemble(load_machine(edited(tmp_path_factory.mktemp("bare"))))


def final(model, drive):
    stepper = CoupledStepper(model)
    heats = list(stepper.run(drive, stepper.uniform(20.0)))
    return heats[-1][1], max(heat.balance_error for *_, heat in heats)


def test_the_description_is_one_of_parts(machine):
    assert not machine.lumped
    assert "holder" not in machine.members
    assert not [p for p in check_meshes(machine).problems if not p.warning]
    paths = [p.path for p in parameters(machine)]
    assert "nodes.holder.capacity" in paths
    assert not any(p.startswith("tcp.expansion") for p in paths)


def test_the_node_follows_its_air_and_its_source_and_nothing_else(machine, full, bare):
    """In the end it is 3 W / (1 W/K) above its air; on the way the exact lag, to the error of the steps."""
    body = full.thermal.bodies[0]
    assert body.members[-1] == "holder"
    assert full.thermal.bodies[1].n == bare.thermal.bodies[1].n
    drive = draw(full.thermal.load_model, 8, hours=0.5).drive
    x = CoupledStepper(full.thermal).steady_state(drive, 0)
    air = drive.environment[0, [e.name for e in full.thermal.load_model.environments].index("shop")]
    gain = drive.theta[0, [f.name for f in full.thermal.load_model.films].index("holder")] / 100.0
    power = drive.power[0, [s.name for s in full.thermal.load_model.sources].index("lamp")]
    reference = machine.machine.reference_temperature
    assert x[0][-1] == pytest.approx(air - reference + power / gain, abs=1e-6)
    names = ["shop_air", "x_position", "x_speed", "x_motor_current"]
    time = np.arange(0.0, 3601.0, 60.0)
    values = {"shop_air": np.full(len(time), 25.0), **{n: np.zeros(len(time)) for n in names[1:]}}
    load = full.thermal.load_model
    calm = evaluate(load, time, {s.name: values[s.column] for s in load.signals}, 60.0)
    now, error = final(full.thermal, calm)
    assert error < 1e-10
    expected = (25.0 + 3.0 - 20.0) * (1.0 - np.exp(-3600.0 / LAG))
    assert now[0][-1] == pytest.approx(expected, rel=2e-3)
    without, _ = final(bare.thermal, evaluate(bare.thermal.load_model, time, {
        s.name: values[s.column] for s in bare.thermal.load_model.signals}, 60.0))  # fmt: skip
    np.testing.assert_allclose(now[0][:-1], without[0], atol=1e-9)
    moved = tcp_at_poses(full.thermal, now) - tcp_at_poses(bare.thermal, without)
    np.testing.assert_allclose(moved, np.tile(PER_KELVIN * now[0][-1], (len(moved), 1)), atol=1e-12)
    for pose, own in zip(full.thermal.poses, tcp_at_poses(full.thermal, now), strict=True):
        np.testing.assert_allclose(full.structure.displacement(pose, now), own, atol=1e-12)


def test_the_reduced_model_has_it_too_and_a_file_keeps_it(machine, full, tmp_path):
    small = rich_model(machine, full, RichOptions(samples=6))
    path = tmp_path / "a.h5"
    write_artefact(path, small, parameters=parameters(machine))
    stored = read_artefact(path).model
    drive = draw(full.thermal.load_model, 5, hours=1.0).drive
    (x, _), (z, _) = final(full.thermal, drive), final(stored, drive)
    np.testing.assert_allclose(sensor_temperatures(stored, z), sensor_temperatures(full.thermal, x), atol=0.05)
    np.testing.assert_allclose(tcp_at_poses(stored, z), tcp_at_poses(full.thermal, x), atol=0.2e-6)
    with pytest.raises(TwinError, match="nodes beside parts"):
        write_c(read_artefact(path), tmp_path / "a.c", ExportOptions())


def test_members_are_written_as_such_nodes(tmp_path):
    """Lags of what was found, exactly those that `responses` are made of; taken out, the text is what it was."""
    text = edited(tmp_path).read_text(encoding="utf-8")
    time = np.arange(0.0, 7201.0, 60.0)
    wall = 20.0 + 4.0 * np.sin(time / 1500.0) * (time > 0.0)
    loads = {"shop_air": np.full(len(time), 20.0), "wall": wall, "x_position": np.zeros(len(time)),
             "x_speed": np.zeros(len(time)), "x_motor_current": np.zeros(len(time))}  # fmt: skip
    units = {"shop_air": "degC", "wall": "degC", "x_position": "m", "x_speed": "m/s", "x_motor_current": "A"}
    run = Run(loads=Table(time, loads, units), initial_temperature=20.0)
    found = [Member(Candidate(Driver("wall", "degC"), lag), np.array([1e-6, np.nan, -2e-6])) for lag in (300.0, 4800.0)]
    written = with_members(text, found, 1e-6, [run])
    assert removed(written) == text
    machine = load_machine(tmp_path, written)
    full = assemble(machine)
    load = full.thermal.load_model
    drive = evaluate(load, time, {s.name: loads[s.column] for s in load.signals}, 60.0)
    x, _ = final(full.thermal, drive)
    names = full.thermal.bodies[0].members
    own = [x[0][full.thermal.bodies[0].member_states(names.index(n)).start] for n in names if n.startswith("follows_")]
    expected = responses(run, [m.candidate for m in found], time[-1:])[0]
    np.testing.assert_allclose(own, expected, atol=0.03)  # of 4 K: the runtime's step, the exact lag


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ('surfaces = ["holder"]', 'surfaces = ["holdr"]', "not a surface"),
        ('area = "0.01 m^2"', "", "no area"),
        ('capacity = "1200 J/K"', 'material = "steel"\nmass = "3 kg"', "without a capacity"),
        ("[films.holder]", "[bars.rod]\nmaterial = 'steel'\norigin = [0,0,0]\ndirection = [1,0,0]\nlength = 1\n"
         "cross_section = 1\nelements = 3\n\n[films.holder]", "both parts and bars"),
    ],
)  # fmt: skip
def test_what_is_refused(tmp_path, old, new, what):
    with pytest.raises(DescriptionError, match=what):
        load_machine(described(tmp_path, HOLDER.replace(old, new)))
    with pytest.raises(DescriptionError, match="no node"):
        load_machine(described(tmp_path, moves=MOVES.replace("holder", "slide")))
