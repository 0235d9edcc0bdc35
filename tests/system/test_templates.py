"""Templates of `twin new` build, verify and run as they are."""

from __future__ import annotations

import json

import jsonschema
import numpy as np
import pytest
import tomlkit

from twin.cli.main import run
from twin.face.template import TEMPLATES
from twin.rom.artefact import read_artefact


@pytest.mark.parametrize("template", TEMPLATES)
def test_a_template_is_a_sound_machine_with_a_run_and_a_schema(template, tmp_path, capsys):
    folder = tmp_path / "mill-2"
    assert run(["new", str(folder), "--template", template]) == 0
    assert f"twin build {folder}" in capsys.readouterr().out
    assert run(["check", str(folder)]) == 0
    assert run(["check", str(folder / "runs" / "first")]) == 0
    told = capsys.readouterr().out
    assert told.count("no problems found") == 2
    assert "name mill-2" in told
    text = (folder / "machine.toml").read_text(encoding="utf-8")
    first = text.splitlines()[0]
    assert first == "#:schema ./machine.schema.json"
    assert "NAME" not in text
    assert text.count("#") > 10  # comments that teach
    schema = json.loads((folder / first.removeprefix("#:schema ./")).read_text(encoding="utf-8"))
    jsonschema.validate(tomlkit.parse(text).unwrap(), schema)
    with pytest.raises(jsonschema.ValidationError, match="conductivty"):
        jsonschema.validate(tomlkit.parse(text.replace("conductivity", "conductivty", 1)).unwrap(), schema)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--template", "tree_axis"], "three_axis"),
        ([], "give either a template or logs"),
        (["--template", "box", "--from-log", "a.csv"], "give either a template or logs"),
        (["--template", "box", "--unit", "a=K"], "are of logs"),
    ],
)
def test_what_new_is_refused_for(arguments, said, tmp_path, capsys):
    assert run(["new", str(tmp_path / "mill"), *arguments]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "mill").exists()


def test_nothing_is_overwritten(tmp_path, capsys):
    (tmp_path / "mill").mkdir()
    (tmp_path / "mill" / "notes.txt").write_text("mine")
    assert run(["new", str(tmp_path / "mill"), "--template", "box"]) == 2
    assert "is there already" in capsys.readouterr().err
    assert [p.name for p in (tmp_path / "mill").iterdir()] == ["notes.txt"]
    assert run(["new", str(tmp_path / "a'b"), "--template", "box"]) == 2
    assert "is no name of a machine" in capsys.readouterr().err


@pytest.mark.parametrize(
    "template",
    [
        pytest.param("lumped", marks=pytest.mark.long),
        pytest.param("box", marks=pytest.mark.long),
        pytest.param("three_axis", marks=pytest.mark.slow),
    ],
)
def test_a_template_builds_verifies_and_runs(template, tmp_path):
    folder, artefact, result = tmp_path / "mill", tmp_path / "mill.h5", tmp_path / "mill_first"
    assert run(["new", str(folder), "--template", template]) == 0
    assert run(["build", str(folder), "-o", str(artefact)]) == 0
    assert run(["verify", str(artefact)]) == 0
    assert run(["run", str(artefact), str(folder / "runs" / "first"), "-o", str(result)]) == 0
    assert read_artefact(artefact).certificate["passed"]
    summary = json.loads((result / "summary.json").read_text(encoding="utf-8"))
    assert summary["heat"]["max_balance_error"] < 1e-10
    moved = np.loadtxt(result / "tcp.csv", delimiter=",", skiprows=1, usecols=(-3, -2, -1))
    assert 1e-6 < np.abs(moved).max() < 500.0  # the tool moves, in any of the file's units less than half a metre
