"""twin hide: what is hidden is there when the copy is simulated; mistakes are told with their remedies."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.support.descriptions import MACHINES, SLIDE
from twin.cli.main import run
from twin.logs.read import read_run
from twin.logs.run import Table, Tcp
from twin.logs.write import write_run
from twin.machine.copy import with_files
from twin.machine.extend import removed
from twin.machine.load import load_machine

RUN = SLIDE.parent / "runs"
SHORT = next(path for path in RUN.iterdir() if (path / "run.toml").exists())
FIVE_AXIS = next(path.parent for path in MACHINES if path.parent.name == "five_axis")


@pytest.fixture
def measured(tmp_path):
    """A run folder with two sensors and the TCP, as if measured: 20 um of growth, set by set."""
    log = read_run(SHORT)
    time = log.loads.time
    columns = {"bed_front": 20.0 + time / 3600.0, "plate": 21.0 + time / 1800.0}
    rows = time[:: max(1, round(900.0 / (time[1] - time[0])))]
    growth = np.repeat(np.linspace(0.0, 20e-6, len(rows))[:, None], 3, axis=1)
    folder = tmp_path / "measured"
    write_run(
        folder,
        replace(
            log,
            temperatures=Table(time, columns, dict.fromkeys(columns, "degC")),
            tcp=Tcp(rows, ("x",), np.linspace(-0.1, 0.1, len(rows))[:, None], growth),
            synthetic=(),
        ),
    )
    return folder


def temperatures(machine, log, out):
    """Of the full model, per sensor."""
    assert run(["simulate", str(machine), str(log), "-o", str(out)]) == 0
    return read_run(out).temperatures.columns


def test_hidden_heat_warms_the_copy_while_it_is_on(tmp_path, capsys):
    out = tmp_path / "hidden"
    call = [
        "hide",
        "heat_source",
        "plate.z_max",
        "40 W",
        str(SLIDE),
        "-o",
        str(out),
        "--from",
        "10 min",
        "--run",
        str(SHORT),
    ]
    assert run(call) == 0
    assert "hidden_1" in capsys.readouterr().out
    assert removed((out / "machine.toml").read_text(encoding="utf-8")) == SLIDE.read_text(encoding="utf-8")
    log = out / "runs" / SHORT.name
    switch = read_run(log).loads
    assert np.array_equal(switch.columns["hidden_1"], (switch.time >= 600.0).astype(float))
    before = temperatures(SLIDE, SHORT, tmp_path / "before")
    after = temperatures(out, log, tmp_path / "after")
    minutes = np.arange(len(before["plate"]))
    warmer = after["plate"] - before["plate"]
    assert np.abs(warmer[minutes <= 10]).max() < 1e-6
    assert np.all(np.diff(warmer[minutes >= 10]) > 0.0)
    assert warmer[-1] > 1.0
    # a log without the switch leaves it off
    off = temperatures(out, SHORT, tmp_path / "off")
    assert off["plate"] == pytest.approx(before["plate"], abs=1e-6)
    assert json.loads((out / "hidden.json").read_text())["amplitude"] == 40.0
    assert run(call) == 0  # its own output may be replaced


@pytest.mark.parametrize(
    ("call", "path", "value"),
    [
        (["film_gain", "films.floor", "3"], ("films", "floor", "gain"), 3.0),
        (["zone", "environment.shop", "-3 K"], ("environment", "shop", "offset"), -3.0),
        (["zone", "environment.shop", "2 K/m"], ("environment", "shop", "gradient"), 2.0),
        (["joint", "contacts.x_screw", "0.5"], ("contacts", "x_screw", "conductance"), 1500.0),
        (["capacity", "bed.z_max", "5 kJ/K", "--setting", "conductance=8 W/K"],
         ("tanks", "hidden_1", "conductance"), 8.0),
        (["misplaced_source", "sources.x_motor", "bed.x_min"], ("sources", "x_motor", "surface"), "bed.x_min"),
        (["coolant", "block.y_min", "200 W/(m^2*K)", "--setting", "temperature=12 degC", "--from", "5 min"],
         ("environment", "hidden_1", "temperature"), 12.0),
        (["sun", "bed.y_max", "50 W", "--from", "5 min", "--to", "20 min"],
         ("sources", "hidden_1", "law"), "switched_heat"),
        (["heat_source", "bed.x_max", "9 W", "--signal", "x_current", "--exponent", "2"],
         ("sources", "hidden_1", "law"), "motor_copper"),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else None,
)  # fmt: skip
def test_the_copy_of_a_machine_says_what_was_asked(call, path, value, tmp_path):
    out = tmp_path / "hidden"
    assert run(["hide", *call[:3], str(SLIDE.parent), "-o", str(out), *call[3:]]) == 0
    machine = load_machine(out)
    section, name, key = path
    assert getattr(getattr(machine, section)[name], key) == value


def test_the_sun_rises_and_sets(tmp_path):
    out = tmp_path / "hidden"
    call = ["hide", "sun", "bed.y_max", "50 W", str(SLIDE), "-o", str(out), "--from", "5 min", "--to", "20 min"]
    assert run([*call, "--run", str(SHORT)]) == 0
    loads = read_run(out / "runs" / SHORT.name).loads
    shine = loads.columns["hidden_1"]
    noon = np.argmax(shine)
    assert 670.0 <= loads.time[noon] < 830.0
    assert shine[noon] == pytest.approx(1.0, abs=0.01)
    assert not shine[(loads.time < 300.0) | (loads.time >= 1200.0)].any()


def test_meshes_and_geometry_come_along(tmp_path):
    out = tmp_path / "hidden"
    assert run(["hide", "heat_source", "bed.x_motor", "10 W", str(FIVE_AXIS), "-o", str(out)]) == 0
    for name in ("geometry.py", "mesh/bed.msh", "mesh/table.msh"):
        assert (out / name).read_bytes() == (FIVE_AXIS / name).read_bytes()
    assert load_machine(out).sources["hidden_1"].surface == "bed.x_motor"


def test_a_mesh_that_lies_elsewhere_says_who_moved_it(tmp_path):
    text = (FIVE_AXIS / "machine.toml").read_text(encoding="utf-8")
    mesh = (FIVE_AXIS / "mesh/bed.msh").as_posix()
    text = text.replace('"mesh/bed.msh"', f'"{mesh}"')
    machine = load_machine(FIVE_AXIS, text)
    for mark in ("found", "hidden"):
        new = tmp_path / mark
        new.mkdir()
        assert f'mesh = "{mesh}"  # {mark}: was "{mesh}"' in with_files(text, machine, new, mark)
        assert not (new / "mesh/bed.msh").exists()
        assert (new / "mesh/table.msh").exists()


@pytest.mark.parametrize(
    "call",
    [
        ["sensor", "sensors.plate", "0.6 K"],
        ["sensor", "sensors.plate", "sensors.bed_front", "--history", "swapped"],
        ["sensor", "sensors.plate", "sensors.bed_front", "--history", "elsewhere"],
        ["signal", "signals.x_motor_current", "2"],
        ["slip", "tcp.dx", "5 um"],
        ["initial_state", "run", "1 K"],
        ["measurement", "tcp.dx:x", "20 um/m", "--history", "frame"],
        ["not_thermal", "tcp.dy", "3 um", "--from", "10 min"],
    ],
    ids=lambda call: call[0],
)
def test_the_copy_of_a_log_is_damaged(call, measured, tmp_path):
    out = tmp_path / "hidden"
    assert run(["hide", *call[:3], str(measured), "-o", str(out), *call[3:]]) == 0
    before, after = read_run(measured), read_run(out)
    families = {"sensor": "temperatures", "signal": "loads", "initial_state": ""}
    table = families.get(call[0], "tcp")
    same = {name: (measured / f"{name}.csv").read_bytes() == (out / f"{name}.csv").read_bytes()
            for name in ("loads", "temperatures", "tcp")}  # fmt: skip
    assert same == {name: name != table for name in same}
    assert after.synthetic == ((table,) if table else ())
    if call[0] == "initial_state":
        assert after.initial_temperature == pytest.approx(before.initial_temperature + 1.0)
    if call[0] == "sensor" and "--history" not in call:
        rise = after.temperatures.columns["plate"] - before.temperatures.columns["plate"]
        assert rise == pytest.approx(0.6, abs=1e-6)
    assert "twin hide" in after.provenance


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (["heat_source", "bed.x_max", "10 K"], "'10 K' is not a quantity in W"),
        (["heat_source", "bed.x_max", "10"], "has no unit: write '10 W'"),
        (["joint", "contacts.nut", "10 W"], "is not a quantity in 1"),
        (["heat_source", "bed.x_maximum", "10 W"], "did you mean 'bed.x_max'"),
        (["film_gain", "films.flor", "3"], "did you mean 'films.floor'"),
        (["heat_sorce", "bed.x_max", "10 W"], "did you mean 'heat_source'"),
        (["coarse_model", "machine", "20"], "twin build"),
        (["sensor", "sensors.plate", "0.6 K"], "give a run folder"),
        (["heat_source", "bed.x_max", "10 W", "--history", "drift"], "--signal"),
        (["heat_source", "bed.x_max", "10 W", "--signal", "x_sped"], "did you mean 'x_speed'"),
        (["heat_source", "bed.x_max", "10 W", "--from", "4 K"], "--from '1 s'"),
        (["heat_source", "bed.x_max", "10 W", "--from", "9 h", "--run", str(SHORT)], "within the run"),
        (["coolant", "bed.x_max", "10 W/(m^2*K)", "--setting", "temprature=3 degC"], "did you mean 'temperature'"),
        (["coolant", "bed.x_max", "10 W/(m^2*K)", "--setting", "temperature"], "has no value"),
    ],
    ids=lambda value: " ".join(value[:3]) if isinstance(value, list) else None,
)
def test_mistakes_are_told(call, told, tmp_path, capsys):
    out = tmp_path / "hidden"
    assert run(["hide", *call[:3], str(SLIDE), "-o", str(out), *call[3:]]) == 2
    assert told in capsys.readouterr().err
    assert not out.exists()


def test_mistakes_about_logs_are_told(measured, tmp_path, capsys):
    out = str(tmp_path / "hidden")
    assert run(["hide", "sensor", "sensors.plat", "0.6 K", str(measured), "-o", out]) == 2
    assert "did you mean 'sensors.plate'" in capsys.readouterr().err
    assert run(["hide", "sensor", "sensors.plate", "0.6 W", str(measured), "-o", out]) == 2
    assert "not a quantity in K" in capsys.readouterr().err
    assert run(["hide", "joint", "contacts.nut", "2", str(measured), "-o", out]) == 2
    assert "give the machine" in capsys.readouterr().err


def test_nothing_is_overwritten(measured, tmp_path, capsys):
    call = ["hide", "sensor", "sensors.plate", "0.6 K", str(measured), "-o"]
    for out in (measured, tmp_path):
        assert run([*call, str(out)]) == 2
        assert "choose another folder" in capsys.readouterr().err
    other = tmp_path / "other"
    other.mkdir()
    (other / "letter.txt").write_text("kept")
    assert run([*call, str(other)]) == 2
    assert "holds other files" in capsys.readouterr().err
    assert (other / "letter.txt").read_text() == "kept"
