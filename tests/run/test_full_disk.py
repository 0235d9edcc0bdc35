"""A disk that fills while results and checkpoints are written: one message, exit 2, nothing half-written."""

from __future__ import annotations

import errno
import hashlib
import json

import pytest
import synthetic
import synthetic_run
from full_disk import full_disk

import twin.run.results
from twin.cli.main import run

MODEL = synthetic.machine(2)


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inputs")
    artefact = synthetic_run.artefact(folder / "a.h5", MODEL)
    return str(artefact), str(synthetic_run.run_folder(folder / "run", MODEL))


def files(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.mark.long
@pytest.mark.parametrize("size", [2_000, 20_000, 80_000])
@pytest.mark.parametrize("every", ["64", "1440"])
def test_a_full_disk_is_one_message_and_leaves_whole_files(inputs, tmp_path, capsys, size, every):
    sound, full = tmp_path / "sound", tmp_path / "full"
    assert run(["run", *inputs, "-o", str(sound)]) == 0
    whole = files(sound)
    assert max(map(len, whole.values())) > 80_000
    capsys.readouterr()
    with full_disk(size):
        assert run(["run", *inputs, "-o", str(full), "--checkpoint", every]) == 2
    told = capsys.readouterr().err
    assert "cannot write: File too large" in told
    assert "remedy: free disk space" in told
    left = files(full)
    assert not [name for name in left if name.endswith(".part")]
    assert all(left[name] == whole[name] for name in left if "checkpoints" not in name)
    assert run(["run", *inputs, "-o", str(full), "--resume", "--checkpoint", every]) == 0  # with space again
    assert files(full)["result.h5"] == whole["result.h5"]


def test_a_disk_that_fills_between_two_files_names_the_one_that_is_lacking(inputs, tmp_path, capsys, monkeypatch):
    def lacking(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    assert run(["run", *inputs, "-o", str(tmp_path / "out")]) == 0
    before = files(tmp_path / "out")
    capsys.readouterr()
    monkeypatch.setattr(twin.run.results, "write_tcp", lacking)
    assert run(["run", *inputs, "-o", str(tmp_path / "out"), "--dt", "30 s"]) == 2
    told = capsys.readouterr().err
    assert "tcp.csv: cannot write: No space left on device" in told
    assert files(tmp_path / "out") == before  # no file of one result beside one of another


def test_the_summary_names_the_files_that_it_is_of(inputs, tmp_path):
    out = tmp_path / "out"
    assert run(["run", *inputs, "-o", str(out)]) == 0
    once = named(out)
    assert set(once) == {"result.h5", "temperatures.csv", "tcp.csv"}
    assert once == {name: hashlib.sha256((out / name).read_bytes()).hexdigest() for name in once}
    assert run(["run", *inputs, "-o", str(out), "--dt", "30 s"]) == 0
    assert all(named(out)[name] != once[name] for name in once)


def named(folder):
    return json.loads((folder / "summary.json").read_text())["files"]
