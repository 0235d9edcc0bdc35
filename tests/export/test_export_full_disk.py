"""A disk that fills while an export is written: one line that names the file, exit 2, and nothing half-written."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest

from twin.cli.main import run
from twin.export.formats import FORMATS

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from full_disk import full_disk


@pytest.mark.long
@pytest.mark.parametrize("size", [0, 30_000])
@pytest.mark.parametrize("name", sorted(FORMATS))
def test_a_full_disk_is_one_error_and_leaves_nothing(slide_artefact, slide_result, tmp_path, capsys, name, size):
    if name.startswith("fmu") and shutil.which("gcc") is None:
        pytest.skip("no gcc")
    form = FORMATS[name]
    out = tmp_path / "out"
    out.mkdir()
    options = ["--result", str(slide_result)] if "result" in form.options else []
    target = out / f"a{form.suffix}"
    with full_disk(size):
        status = run(["export", str(slide_artefact), "--format", name, "-o", str(target), *options])
    told = capsys.readouterr().err
    left = sorted(p.name for p in out.rglob("*"))
    if status == 0:  # it is small
        assert 0 < max(p.stat().st_size for p in out.rglob("*") if p.is_file()) <= size
        return
    assert status == 2
    assert left == []
    assert len(told.splitlines()) == 2, told
    assert f"error: {out}/a" in told
    assert "cannot write: File too large" in told
