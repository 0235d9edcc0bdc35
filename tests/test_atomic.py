"""Files and folders appear whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from twin.atomic import atomic_folder, atomic_path, check_file, check_folder
from twin.errors import TwinError


def test_a_folder_replaces_the_older_one(tmp_path: Path):
    for text in ("old", "new"):
        with atomic_folder(tmp_path / "a" / "b") as folder:
            (folder / text).write_text(text)
    assert [p.name for p in (tmp_path / "a" / "b").iterdir()] == ["new"]
    assert [p.name for p in (tmp_path / "a").iterdir()] == ["b"]


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError])
def test_a_folder_survives_an_interruption_between_the_renames(tmp_path: Path, monkeypatch, which, error):
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "old").write_text("old")
    rename, calls = os.replace, []

    def interrupted(source: Path, target: Path) -> None:
        calls.append(source)
        if len(calls) == which + 1:
            raise error
        rename(source, target)

    monkeypatch.setattr(os, "replace", interrupted)
    with pytest.raises((KeyboardInterrupt, TwinError)), atomic_folder(tmp_path / "b") as folder:
        (folder / "new").write_text("new")
    assert [p.name for p in (tmp_path / "b").iterdir()] == ["old"]
    assert [p.name for p in tmp_path.iterdir()] == ["b"]


@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError, ValueError])
def test_a_file_keeps_its_content_when_writing_fails(tmp_path: Path, error):
    target = tmp_path / "f"
    target.write_text("old")

    def half(path: Path) -> None:
        path.write_text("half")
        raise error

    with pytest.raises((KeyboardInterrupt, ValueError, TwinError)), atomic_path(target) as path:
        half(path)
    assert target.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["f"]


def test_places_that_cannot_be_written_are_told_beforehand(tmp_path: Path, monkeypatch):
    check_file(tmp_path / "new" / "folder" / "a.h5")
    check_folder(tmp_path)
    (tmp_path / "file").write_text("mine")
    with pytest.raises(TwinError, match="is a folder"):
        check_file(tmp_path)
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(TwinError, match="is a file") as caught:
            check_folder(folder)
        assert str(caught.value).startswith(f"{tmp_path / 'file'}: ")
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(TwinError, match="Permission denied"):
        check_file(tmp_path / "new" / "a.h5")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_a_device_or_pipe_is_not_replaced_by_a_file(tmp_path: Path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(TwinError, match="pipe or device"), atomic_path(pipe) as temporary:
        temporary.write_text("new")
    with pytest.raises(TwinError, match="pipe or device"):
        check_file(pipe)
    assert pipe.is_fifo()
    assert [p.name for p in tmp_path.iterdir()] == ["pipe"]
