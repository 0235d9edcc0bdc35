"""What `twin export` refuses: one error that says what, where and how to correct it; nothing half-written."""

from __future__ import annotations

import os

import pytest

import twin
from twin.cli.main import run
from twin.errors import TwinError


def refused(capsys, *arguments):
    status = run(["export", *map(str, arguments)])
    told = capsys.readouterr().err
    assert status == 2
    assert "Traceback" not in told
    assert "remedy" in told
    return told


def test_an_unknown_format(slide_artefact, tmp_path, capsys):
    assert "formats are: c, fmu2, fmu3" in refused(capsys, slide_artefact, "--format", "fmu4", "-o", tmp_path / "a.fmu")


def test_an_option_of_another_format(slide_artefact, tmp_path, capsys):
    told = refused(capsys, slide_artefact, "--format", "c", "-o", tmp_path / "a.c", "--poses")
    assert "--precision" in told


def test_a_damaged_artefact(slide_artefact, tmp_path, capsys):
    content = bytearray(slide_artefact.read_bytes())
    content[len(content) // 2] ^= 4
    (tmp_path / "a.h5").write_bytes(content)
    assert "damaged" in refused(capsys, tmp_path / "a.h5", "--format", "c", "-o", tmp_path / "a.c")
    assert not list(tmp_path.glob("*.c"))


def test_an_output_that_is_an_input_or_a_folder(slide_artefact, tmp_path, capsys):
    assert "input" in refused(capsys, slide_artefact, "--format", "fmu2", "-o", slide_artefact)
    assert "folder" in refused(capsys, slide_artefact, "--format", "fmu2", "-o", tmp_path)
    for name in ("loads.csv", "temperatures.csv", "tcp.csv", "summary.json"):
        (tmp_path / name).write_text("measured")
        form = name.rpartition(".")[2]
        assert "input" in refused(capsys, slide_artefact, "--format", form, "--result", "x", "-o", tmp_path / name)
        assert (tmp_path / name).read_text() == "measured"
    assert "C file" in refused(capsys, slide_artefact, "--format", "c", "-o", tmp_path / "a.fmu")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_cannot_be_written(slide_artefact, tmp_path, capsys):
    tmp_path.chmod(0o500)
    assert "cannot write" in refused(capsys, slide_artefact, "--format", "c", "-o", tmp_path / "a.c")


def test_no_compiler(slide_artefact, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr("twin.export.compiler.find_spec", lambda name: None)
    with pytest.raises(TwinError, match="no C compiler"):
        twin.export(slide_artefact, "fmu2", tmp_path / "a.fmu")
    assert not list(tmp_path.iterdir())


def test_a_compiler_that_fails(slide_artefact, tmp_path, monkeypatch):
    monkeypatch.setenv("CC", "false")
    with pytest.raises(TwinError, match="the compiler false failed"):
        twin.export(slide_artefact, "fmu2", tmp_path / "a.fmu")
    assert not list(tmp_path.iterdir())


def test_an_axis_that_is_named_twice(slide_artefact, tmp_path, capsys):
    at = ("--at", "x=1 mm, x=2 mm")
    assert "'x' is named twice" in refused(capsys, slide_artefact, "--format", "mat", *at, "-o", tmp_path / "a.mat")
