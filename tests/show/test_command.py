"""`twin show` and what `twin check` says of it."""

from __future__ import annotations

import os
import shutil

import pytest

from tests.support.descriptions import SLIDE, edited
from twin.cli.main import run


def test_the_page_is_named_after_the_machine(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["show", str(SLIDE.parent)]) == 0
    *lines, last = capsys.readouterr().out.splitlines()
    assert last == "slide.html"
    assert any(line.startswith("uncovered: 0.418 m² of bed, adiabatic") for line in lines)
    page = (tmp_path / "slide.html").read_text(encoding="utf-8")
    assert [p.name for p in tmp_path.iterdir()] == ["slide.html"]
    assert page.count("<script") == 2
    assert 'src="' not in page.split("<script")[0]
    assert "default-src 'none'" in page


def test_check_ends_with_how_to_see_the_machine(tmp_path, capsys):
    assert run(["check", str(SLIDE.parent)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f"see it: twin show {SLIDE.parent}"
    run(["check", str(SLIDE.parent / "runs" / "short")])
    assert "twin show" not in capsys.readouterr().out
    spaced = tmp_path / "my machine"
    spaced.mkdir()
    shutil.copy(SLIDE, spaced)
    run(["check", str(spaced)])
    assert capsys.readouterr().out.splitlines()[-1] == f"see it: twin show '{spaced}'"


def test_names_cannot_leave_the_folder_or_the_script(tmp_path, monkeypatch):
    path = edited(tmp_path, ('name = "slide"', 'name = "../</script><b>"'))
    out = tmp_path / "out"
    out.mkdir()
    monkeypatch.chdir(out)
    assert run(["show", str(path)]) == 0
    (page,) = out.iterdir()
    assert "</script><b>" not in page.read_text(encoding="utf-8")


@pytest.mark.parametrize("bad", ["folder", "device", "description", "mesh", "axis"])
def test_bad_input_is_one_error_and_no_page(tmp_path, capsys, bad):
    plate = "box = { origin = [-0.06, -0.06, 0.20], size = [0.12, 0.12, 0.03], divisions = [3, 3, 1] }"
    edits = {"mesh": (plate, 'mesh = "no.msh"'), "axis": ('carries = ["slide"]', 'carries = ["bed"]')}
    path = edited(tmp_path, *([edits[bad]] if bad in edits else []))
    pipe = tmp_path / "pipe"
    if bad == "device":
        os.mkfifo(pipe)
    target = {"folder": tmp_path, "device": pipe, "description": path}.get(bad, tmp_path / "page.html")
    before = path.read_text(encoding="utf-8")
    assert run(["show", str(path), "-o", str(target)]) == 2
    told = capsys.readouterr().err
    assert told.startswith("error: ")
    assert "Traceback" not in told
    assert {p.name for p in tmp_path.iterdir()} == {"machine.toml", *(["pipe"] if bad == "device" else [])}
    assert bad != "device" or not pipe.is_file()
    assert path.read_text(encoding="utf-8") == before
