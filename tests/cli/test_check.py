"""`twin check` from the outside."""

from __future__ import annotations

import json
import shutil
import sys
import tomllib
from pathlib import Path

import jsonschema
import pytest

from tests.logs.test_read import write
from tests.support import synthetic
from tests.support.descriptions import SLIDE, edited
from twin.cli.main import run
from twin.rom.artefact import write_artefact

RUN = SLIDE.parent / "runs" / "short"


def check(capsys: pytest.CaptureFixture, *arguments: object) -> tuple[int, dict]:
    status = run(["check", "--json", *map(str, arguments)])
    return status, json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("path", [SLIDE, SLIDE.parent])
def test_sound_machine(capsys, path):
    assert run(["check", str(path)]) == 0
    out = capsys.readouterr().out
    assert "no problems found" in out
    assert "2121 nodes" in out


def test_sound_run_against_the_machine_it_lies_under(capsys):
    status, found = check(capsys, RUN)
    assert (status, found["ok"], found["facts"]["machine"]) == (0, True, "slide")


def test_three_typos_in_one_go(tmp_path, capsys):
    edits = [
        ('material = "aluminium"', 'material = "aluminum"'),
        ("stroke = [", "strok = ["),
        ('"x_current" }', '"x_curent" }'),
    ]
    status, found = check(capsys, edited(tmp_path, *edits))
    assert status == 2
    assert len(found["problems"]) == 3
    assert all("did you mean" in p["remedy"] for p in found["problems"])


def test_what_does_not_fit_a_mesh_is_told_with_its_line(tmp_path, capsys):
    path = edited(tmp_path, ("position = [0.07, 0.05, 0.2]", "position = [0.07, 0.05, 2]"))
    status, found = check(capsys, path)
    assert status == 2
    (problem,) = found["problems"]
    line = path.read_text().split("position = [0.07, 0.05, 2]")[0].count("\n") + 1
    place, _, told = problem["where"].rpartition(" (line ")
    assert place.startswith(f"{path}: sensors.")
    assert line - 5 < int(told.rstrip(")")) <= line  # of the sensor's table, or of the key
    for command in (["build", path, "-o", tmp_path / "a.h5"], ["simulate", path, RUN, "-o", tmp_path / "out"]):
        assert run([str(c) for c in command]) == 2  # no other words there
        assert f"error: {problem['where']}: {problem['what']}" in capsys.readouterr().err


def test_materials_and_meshes_are_both_reported(tmp_path, capsys):
    path = edited(
        tmp_path, ('"45 W/(m*K)"', '"45 W/(mm*K)"'), ("position = [0.07, 0.05, 0.2]", "position = [0.07, 0.05, 2]")
    )
    status, found = check(capsys, path)
    assert status == 2
    assert "materials.steel.conductivity (line " in found["problems"][0]["where"]
    assert "sensors.slide.position (line " in found["problems"][1]["where"]
    status, found = check(capsys, "--no-meshes", path)
    assert len(found["problems"]) == 1


def test_warnings_alone_exit_with_zero(tmp_path, capsys):
    path = edited(tmp_path, ("[environment.shop]", '[signals.spare]\nunit = "A"\nrange = [0, 1]\n\n[environment.shop]'))
    assert run(["check", str(path)]) == 0
    out = capsys.readouterr().out
    assert out.startswith("warning: ")
    assert "0 errors, 1 warning" in out


def test_run_with_a_missing_signal(tmp_path, capsys):
    shutil.copytree(RUN, tmp_path / "run")
    loads = tmp_path / "run" / "loads.csv"
    loads.write_text(loads.read_text().replace("x_motor_current", "x_motor_curent"))
    status, found = check(capsys, tmp_path / "run", "--machine", SLIDE)
    (problem,) = found["problems"]
    assert status == 2
    assert "no column 'x_motor_current'" in problem["what"]
    assert "did you mean 'x_motor_curent'?" in problem["remedy"]


def test_run_that_names_its_machine(tmp_path, capsys):
    shutil.copytree(RUN, tmp_path / "run")
    with (tmp_path / "run" / "run.toml").open("a") as f:
        f.write('machine = "../machine.toml"\n')
    edited(tmp_path, ('unit = "m/min"', 'unit = "m^2"'))
    status, found = check(capsys, tmp_path / "run")
    assert status == 2  # a broken machine is reported along with the run
    assert any("machine.toml" in p["where"] for p in found["problems"])
    edited(tmp_path)
    assert check(capsys, tmp_path / "run")[0] == 0


def test_run_without_a_machine_is_checked_for_itself(tmp_path, capsys):
    folder = write(tmp_path / "run", "time [s];x [mm]\n0;1,5\n5;2,5\n5;3\n")
    status, found = check(capsys, folder)
    assert status == 2
    assert [p["warning"] for p in found["problems"]] == [True, False]


def damaged(folder: Path, old: str, new: str) -> Path:
    shutil.copytree(RUN, folder)
    loads = folder / "loads.csv"
    text = loads.read_text()
    assert old in text
    loads.write_text(text.replace(old, new, 1))
    return folder


@pytest.mark.parametrize(
    ("old", "new", "line", "what"),
    [
        ("\n50,", "\n40,", "(line 12)", "time runs backwards"),
        ("\n50,", "\n45,", "(line 12)", "the same time twice"),
        ("time [s]", "time [ms]", "loads.csv", "run.toml says 5 s: a factor 1000"),
        ("\n50,", "\n50;", "(line 12)", "cells under"),
    ],
)
def test_what_the_check_refuses_every_verb_refuses(tmp_path, capsys, old, new, line, what):
    folder = damaged(tmp_path / "run", old, new)
    status, found = check(capsys, folder, "--machine", SLIDE)
    errors = [p for p in found["problems"] if not p["warning"]]
    assert status == 2
    assert line in errors[0]["where"]
    assert what in errors[0]["what"]
    assert run(["losses", str(SLIDE), "--run", str(folder)]) == 2
    refused = capsys.readouterr().err
    assert all(p["what"] in refused and p["where"] in refused for p in errors)


def test_warnings_of_a_run_name_lines_and_columns(tmp_path, capsys):
    folder = damaged(tmp_path / "run", "x_speed [m/min]", "x_speed [m/s]")
    status, found = check(capsys, folder, "--machine", SLIDE)
    assert (status, found["ok"]) == (0, True)
    (slip,) = [p for p in found["problems"] if "times the speed of" in p["what"]]
    assert "'x_speed' is 60" in slip["what"]
    assert "60: minutes for seconds" in slip["what"]
    (outside,) = [p for p in found["problems"] if "rows outside" in p["what"]]
    assert "(line 2 and " in outside["where"]


@pytest.mark.parametrize("name", ["nothing", "."])
def test_neither_machine_nor_run(tmp_path, capsys, name):
    assert run(["check", str(tmp_path / name)]) == 2
    assert "remedy" in capsys.readouterr().err


def test_schema(capsys):
    assert run(["check", "--schema"]) == 0
    jsonschema.validate(tomllib.loads(Path(SLIDE).read_text()), json.loads(capsys.readouterr().out))


def test_no_path(capsys):
    assert run(["check"]) == 2
    assert "PATH" in capsys.readouterr().err


def test_run_against_an_artefact_needs_no_description(tmp_path, capsys):
    write_artefact(tmp_path / "A.h5", synthetic.machine())
    folder = write(tmp_path / "run", "time [s],ambient [degC],x_position [m]\n0,20,0.1\n5,20,0.2\n")
    status, found = check(capsys, folder, "--machine", tmp_path / "A.h5")
    assert status == 2
    missing = [p["what"] for p in found["problems"] if not p["warning"]]
    assert missing == [f"no column '{a}'" for a in ("x_speed", "x_current", "y_position", "y_speed", "y_current")]


def test_run_is_checked_where_descriptions_cannot_be_read(tmp_path, capsys, monkeypatch):
    edited(tmp_path)
    shutil.copytree(RUN, tmp_path / "runs" / "short")
    monkeypatch.setitem(sys.modules, "twin.machine.load", None)  # an edge computer without pydantic
    status, found = check(capsys, tmp_path / "runs" / "short")
    assert (status, len(found["problems"])) == (0, 1)
    assert "no machine is known" in found["problems"][0]["what"]


def test_limits_of_an_axis_ask_for_a_sampling(tmp_path, capsys):
    limits = 'position = "x_position"\nspeed = "1 m/s"\nacceleration = "10 m/s^2"\njerk = "200 m/s^3"\n'
    path = edited(tmp_path, ('position = "x_position"\n', limits))
    status, found = check(capsys, RUN, "--machine", path)
    (problem,) = [p for p in found["problems"] if "limits ask for" in p["what"]]
    assert (status, problem["warning"]) == (0, True)
    assert "ask for 5 ms (current of axis 'x')" in problem["what"]  # a segment of the screw is 70 mm: 7 ms
    fast = limits.replace('jerk = "200 m/s^3"\n', "").replace('acceleration = "10 m/s^2"\n', "")
    status, found = check(capsys, RUN, "--machine", edited(tmp_path, ('position = "x_position"\n', fast)))
    assert any("7 ms (position of axis 'x')" in p["what"] for p in found["problems"])


JOINT = (
    'surfaces = ["bed.z_min", "foot_1.z_max"]\nconductance = "2000 W/(m^2*K)"',
    'surfaces = ["bed.z_min", "foot_1.z_max"]\n{joint}',
)


@pytest.mark.parametrize(
    ("joint", "place", "what"),
    [
        ('joint = { law = "bolted_joints", parameters = {} }', "contacts.foot_1.joint", "no joint law"),
        ('joint = { law = "bolted_joint", parameters = {} }', "contacts.foot_1.joint.parameters", "needs"),
        ("", "contacts.foot_1", "give either a conductance or a joint law"),
        ('conductance = 2000.0\njoint = { law = "bolted_joint" }', "contacts.foot_1", "give either"),
    ],
)
def test_a_joint_without_a_sound_conductance_is_an_error_with_its_place(capsys, tmp_path, joint, place, what):
    path = edited(tmp_path, (JOINT[0], JOINT[1].format(joint=joint)))
    status, found = check(capsys, path)
    assert status == 2
    problems = [p for p in found["problems"] if not p["warning"]]
    assert all(place in p["where"] and "line" in p["where"] for p in problems)
    assert any(what in p["what"] for p in problems)


def test_a_film_needs_surfaces_and_a_scale_an_expansion_of_a_material(capsys, tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    empty = edited(tmp_path / "a", ('surfaces = ["foot_1.*", "foot_2.*", "foot_3.*"]', "surfaces = []"))
    status, found = check(capsys, empty)
    assert status == 2
    assert "films.floor.surfaces" in found["problems"][0]["where"]
    scale = 'scale = "bed.z_max", reader = "slide.y_max", fixed_at = "0 mm", expansion = 10.0'
    position = 'position = "x_position"'
    encoded = edited(tmp_path / "b", (position, position + "\nencoder = { kind = 'linear', " + scale + " }"))
    status, found = check(capsys, "--no-meshes", encoded)
    assert status == 2
    assert any("axes.x.encoder.expansion" in p["where"] for p in found["problems"])
