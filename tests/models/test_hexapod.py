"""The hexapod of paper 001: one strut described, six placed; poses, corrections and heat along every screw."""

from __future__ import annotations

import json
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from models.scripts import load_script
from twin.build.elastic_inputs import elastic_inputs
from twin.build.full_model import FullModel, assemble
from twin.build.stepper import CoupledStepper, sensor_temperatures
from twin.cli.main import run
from twin.errors import DescriptionError
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.machine.load import load_machine
from twin.machine.platform import geometry_of
from twin.rom.drive import evaluate
from twin.rom.parallel import Pose, forward, inverse, rotated, worst_condition

FOLDER = Path(__file__).parents[2] / "models" / "hexapod"
STRUTS = tuple(f"strut_{k}" for k in range(1, 7))
PLACE = np.array([0.01, -0.02, 0.03, 0.0, 0.015, -0.03])

script = partial(load_script, FOLDER)


@pytest.fixture(scope="module")
def machine():
    return load_machine(FOLDER)


@pytest.fixture(scope="module")
def full(machine) -> FullModel:
    return assemble(machine)


def fields(full: FullModel, seed: int) -> list[np.ndarray]:
    """Temperatures above the reference, none like another."""
    rng = np.random.default_rng(seed)
    return [rng.uniform(0.0, 10.0, body.n) for body in full.thermal.bodies]


def test_check_finds_nothing(capsys):
    assert run(["check", "--json", str(FOLDER)]) == 0
    assert json.loads(capsys.readouterr().out)["problems"] == []


def test_rows_of_the_run_are_those_of_its_records():
    runs = script("runs/make_runs.py")
    log = read_run(FOLDER / "runs" / "mixed_paths").loads
    chosen = np.random.default_rng(1).integers(runs.PER_BLOCK, size=2880)
    for k in (0, 333, 2879):
        told = runs.row(runs.records(k * runs.PER_BLOCK, runs.PER_BLOCK), chosen[k])
        found = [log.columns[name][k] for name in runs.NAMES]
        np.testing.assert_allclose(found, told, atol=1e-3)


def test_six_struts_are_one(full):
    """Every strut's bodies have the same matrices: what differs is which signals they read."""
    by_name = {body.name: body for body in full.thermal.bodies}
    for first in ("strut_1_motor", "strut_1_nut"):
        one = by_name[first]
        for strut in STRUTS[1:]:
            other = by_name[first.replace("strut_1", strut)]
            for matrix in ("E", "A0"):
                a, b = (np.asarray(getattr(body, matrix).todense()) for body in (one, other))
                np.testing.assert_array_equal(a, b)


def test_lengths_of_the_records_are_those_of_the_machine(machine):
    """make_runs.py has its own closed inverse."""
    runs, geometry = script("runs/make_runs.py"), geometry_of(machine)
    shift, tilt = runs.path(np.array([1000.0, 2500.0]))
    own = runs.lengths(shift, tilt) - runs.lengths(np.zeros((1, 3)), np.zeros((1, 2)))
    for k in range(2):
        turn = rotated(np.array([0.0, tilt[k, 1], 0.0])) @ rotated(np.array([tilt[k, 0], 0.0, 0.0]))
        np.testing.assert_allclose(own[k], inverse(geometry, Pose(shift[k], turn)), atol=1e-9)


def test_thirty_millimetres_in_every_direction(machine):
    geometry, (low, high) = geometry_of(machine), machine.axes["strut_1_length"].stroke
    for corner in product((-0.03, 0.03), repeat=3):
        position = inverse(geometry, Pose(np.array(corner), np.eye(3)))
        assert low < position.min() < position.max() < high
    ends = np.array(list(product((low, high), repeat=6)))
    lever = float(np.linalg.norm(geometry.joint - geometry.point, axis=1).mean())
    assert worst_condition(geometry, ends, lever) == pytest.approx(4.4, abs=0.05)


def test_tool_moves_as_longer_struts_move_it(machine, full):
    """Grown struts stand where the platform has lengths that are longer by what they have grown."""
    geometry, temperatures = geometry_of(machine), fields(full, 0)
    rows = full.structure.strut_error_rows(PLACE)
    grown = np.sum([r @ T for r, T in zip(rows, temperatures, strict=True)], axis=0)
    assert 20e-6 < np.abs(grown).max() < 200e-6
    shift = forward(geometry, PLACE + grown).shift - forward(geometry, PLACE).shift
    np.testing.assert_allclose(full.structure.displacement(PLACE, temperatures), shift, atol=5e-9)


def test_a_strut_grows_from_its_bearing_to_the_nut(machine, full):
    """One kelvin in one strut: 280 mm of screw, 100 mm of housing and 270 mm of tube, of steel, at position zero."""
    temperatures = [np.zeros(body.n) for body in full.thermal.bodies]
    for body, T in zip(full.thermal.bodies, temperatures, strict=True):
        if body.name in ("strut_3_motor", "strut_3_nut"):
            T[:] = 1.0
    rows = full.structure.strut_error_rows(np.zeros(6))
    grown = np.sum([r @ T for r, T in zip(rows, temperatures, strict=True)], axis=0)
    np.testing.assert_allclose(np.delete(grown, 2), 0.0, atol=1e-15)
    assert grown[2] == pytest.approx(11.7e-6 * (0.100 + 0.280 + 0.270), rel=2e-3)
    longer = np.sum([r @ T for r, T in zip(full.structure.strut_error_rows(PLACE), temperatures, strict=True)], axis=0)
    assert longer[2] - grown[2] == pytest.approx(11.7e-6 * PLACE[2], rel=1e-9)


def test_offsets_of_the_struts_leave_nothing(machine, full):
    """-e in the struts takes up displacement and tilt, to first order in 100 um."""
    geometry, temperatures = geometry_of(machine), fields(full, 1)
    error = np.sum([r @ T for r, T in zip(full.structure.strut_error_rows(PLACE), temperatures, strict=True)], axis=0)
    uncorrected, wanted = forward(geometry, PLACE + error), forward(geometry, PLACE)
    assert np.linalg.norm(uncorrected.shift - wanted.shift) > 10e-6
    tool = full.structure.displacement(PLACE, temperatures)
    moved_tool = forward(geometry, PLACE - error).shift - wanted.shift
    np.testing.assert_allclose(tool + moved_tool, 0.0, atol=2e-8)


def test_few_inputs_are_all_the_tool_reads(full):
    structure, W = elastic_inputs(full.structure)
    temperatures = fields(full, 2)
    read = [w @ T for w, T in zip(W, temperatures, strict=True)]
    np.testing.assert_allclose(
        structure.displacement(PLACE, read), full.structure.displacement(PLACE, temperatures), rtol=1e-12
    )


def test_heat_goes_to_the_segments_below_the_nuts(full):
    """Records of 10 ms over a block: each nut's heat lies where its records are, and none is lost."""
    runs, load = script("runs/make_runs.py"), full.thermal.load_model
    first = 100_000
    block = runs.records(first, 6001)
    time = runs.CORE * np.arange(6001)
    signals = {name: block[:, k] for k, name in enumerate(runs.NAMES)} | {"ambient": np.full(6001, 21.0)}
    drive = evaluate(load, time, signals, 60.0, 1)
    contacts = [s.name for s in load.sources if s.contact]
    for k, strut in enumerate(STRUTS):
        heat = drive.contact_heat[0, contacts.index(f"{strut}_nut")]
        power = drive.power[0, [s.name for s in load.sources].index(f"{strut}_nut")]
        assert heat.sum() == pytest.approx(power, rel=1e-12)
        rail = next(r for r in load.rails if r.name.startswith(f"{strut}_screw"))
        along = heat[rail.first_port : rail.first_port + len(rail.stations)]
        assert along.sum() == pytest.approx(0.5 * power, rel=1e-12)
        nut = 0.28 + block[:-1, 3 * k]  # m from the bearing
        shares = np.histogram(nut, bins=np.linspace(0.0, 0.5, 21))[0] / 6000
        assert np.count_nonzero(along) >= 2
        np.testing.assert_allclose(along / along.sum(), shares, atol=0.12)
        assert set(np.flatnonzero(along > 1e-9)) <= set(np.flatnonzero(shares)) | {np.flatnonzero(shares)[-1] + 1}


@pytest.mark.long
def test_a_morning_of_mixed_paths(full):
    """An hour and a half by the full model: balanced, screws and motors warm, the tool some ten um off."""
    load, log = full.thermal.load_model, read_run(FOLDER / "runs" / "mixed_paths")
    drive = evaluate(load, log.loads.time, signal_values(log, load.signals), 60.0, 60)
    stepper = CoupledStepper(full.thermal)
    first = x = stepper.uniform(21.0)
    for _, x, heat in stepper.run(drive, x):  # noqa: B007, B020
        assert heat.balance_error < 1e-9
    rise = sensor_temperatures(full.thermal, x) - sensor_temperatures(full.thermal, first)
    rises = dict(zip(full.thermal.sensors, rise, strict=True))
    assert min(rises[f"{s}_motor"] for s in STRUTS) > 5.0
    assert 0.5 < min(rises[f"{s}_screw"] for s in STRUTS) < max(rises[f"{s}_screw"] for s in STRUTS) < 10.0
    w = full.structure.displacement(np.zeros(6), x) - full.structure.displacement(np.zeros(6), first)
    assert 5e-6 < np.linalg.norm(w) < 60e-6
    assert abs(w[2]) > 5.0 * np.linalg.norm(w[:2])  # six struts that warm alike lower the tool


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('stroke = ["-45 mm", "45 mm"]', 'stroke = ["-200 mm", "200 mm"]', "no platform pose"),
        ('screw = "screw"', 'screw = "tube"', "no bar"),
        ("joint = [0.65, 0.0, 0.0]", "joint = [0.65, 0.1, 0.0]", "does not point along its strut"),
        ('moving = "platform"', 'moving = "plattform"', "did you mean 'platform'"),
        ("[tcp.platform]", "[tcp.screws]\nstrut_1_screw = 'tool'\n[tcp.platform]", "screws beside a platform"),
        ("growth = { housing", "growth = { hosing", "no node or bar"),
    ],
)
def test_mistakes_of_platforms(tmp_path, old, new, said):
    text = (FOLDER / "machine.toml").read_text()
    assert old in text
    (tmp_path / "machine.toml").write_text(text.replace(old, new, 1))
    with pytest.raises(DescriptionError) as caught:
        load_machine(tmp_path)
    assert said in str(caught.value)
