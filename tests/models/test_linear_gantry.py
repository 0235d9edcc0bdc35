"""The gantry of paper 004: symmetric, small rises, an error along Y that the room doubles."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from models.scripts import load_script
from twin.build.full_model import assemble
from twin.cli.main import run
from twin.machine.load import load_machine
from twin.machine.wiring import joint_conductance
from twin.physics.joints import bolt_force

FOLDER = Path(__file__).parents[2] / "models" / "linear_gantry"
RUNS = ("constant_room", "ramped_room", "standing")

script = partial(load_script, FOLDER)


@pytest.fixture(scope="module")
def machine():
    return load_machine(FOLDER)


@pytest.fixture(scope="module")
def stories(machine):
    """What the full model does in every run (about 10 s)."""
    positioning_error = script("positioning_error.py")
    full = assemble(machine)
    return {name: positioning_error.story(full, FOLDER / "runs" / name) for name in RUNS}


def test_check_finds_nothing(capsys):
    assert run(["check", "--json", str(FOLDER)]) == 0
    assert json.loads(capsys.readouterr().out)["problems"] == []


@pytest.mark.parametrize("name", RUNS)
def test_runs_are_what_make_runs_writes(name, tmp_path):
    make_runs = script("runs/make_runs.py")
    make_runs.write(tmp_path / name, make_runs.SCENARIOS[name])
    for file in ("loads.csv", "run.toml"):
        assert (tmp_path / name / file).read_text() == (FOLDER / "runs" / name / file).read_text()


def test_a_stroke_of_the_paper():
    """600 mm at 70 m/min and 10 m/s^2: 0.631 s; mass and acceleration alone give 3 kN while the speed changes."""
    speed, force, duration = script("runs/make_runs.py").cycle()
    assert duration == pytest.approx(0.6 / (70 / 60) + (70 / 60) / 10.0)
    assert speed * duration == pytest.approx(0.6)
    assert force == pytest.approx(3000.0 * np.sqrt(2 * (70 / 60) / 10.0 / duration), rel=1e-3)


def test_every_part_has_its_mirror_image(machine):
    boxes = {(p.material, *np.round([*p.box.origin, *p.box.size], 9), p.box.divisions) for p in machine.parts.values()}
    for material, x, y, z, a, b, c, divisions in boxes:
        assert (material, round(-x - a, 9) + 0.0, y, z, a, b, c, divisions) in boxes


def test_joints_by_roughness_and_bolts(machine):
    joints = [c for c in machine.contacts.values() if c.joint is not None]
    assert len(joints) > 20
    assert {c.joint.law for c in joints} == {"bolted_joint"}
    area = 0.22 * 0.24  # m^2, of a column below the cross rail
    pressed = 8 * bolt_force(80.0, 1.75e-3, 10.863e-3, 0.12, 13.5e-3, 16.6e-3) / area
    assert pressed == pytest.approx(8 * 41.26e3 / area, rel=1e-3)  # the paper's M12 of eq (10)
    sigma, k = 1.6e-6 * np.sqrt(2.0), 170.0
    solid = 1.25 * k * 0.15 * np.sqrt(2.0) / sigma * (pressed / 1.1e9) ** 0.95  # eq (8)
    assert solid < joint_conductance("column_1", machine) < 1.1 * solid


@pytest.mark.long
def test_the_papers_rise_and_error_within_a_factor_of_two(stories):
    """1.2 K in the columns; 12 um, with the reader 18 um, along Y."""
    told = stories["constant_room"]
    rise = max(told.rises["column_1"], told.rises["column_2"])
    assert 1.2 < rise < 2.4
    assert 9e-6 < told.tcp[-1, 1] < 24e-6
    assert told.terms.total == pytest.approx(told.tcp[-1, 1], abs=1e-12)
    assert 2.5e-6 < told.terms.reader < 10e-6  # the paper's 5 um
    hottest = max(told.rises, key=lambda part: told.rises[part])
    assert hottest.startswith(("y_carriage", "y_primary", "column"))  # near the motors
    assert told.balance < 1e-10


@pytest.mark.long
@pytest.mark.parametrize("name", RUNS)
def test_symmetric_heat_moves_nothing_across(stories, name):
    told = stories[name]
    assert np.abs(told.tcp[:, 0]).max() < 0.5e-6  # what the mesh is off by; the paper has 0.1 um
    for part, rise in told.rises.items():
        if part.endswith("_1") and f"{part[:-1]}2" in told.rises and part[:2] not in ("x_", "z_"):
            assert told.rises[f"{part[:-1]}2"] == pytest.approx(rise, rel=0.05), part


@pytest.mark.long
def test_a_room_that_warms_doubles_the_error(stories):
    constant, ramped, standing = (stories[name].tcp[-1, 1] for name in RUNS)
    assert 1.5 < ramped / constant < 2.5
    assert 0.5 * (ramped - constant) < standing < 1.5 * (ramped - constant)


@pytest.mark.long
def test_the_coolers_take_most_of_the_heat(machine, stories):
    """Eq (5): copper loss of a motor at the run's current, of which 13.5 W remain."""
    power = stories["constant_room"].power
    assert power["y_motor_1"] == pytest.approx(power["y_motor_2"], rel=0.01)
    copper = 3 * 0.75 * (1 + 0.00393 * 5.5) * 14.6**2
    assert 0.01 * copper < power["y_motor_1"] < 0.05 * copper
