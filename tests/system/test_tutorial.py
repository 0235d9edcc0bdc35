"""docs/tutorial.md, run as it stands: its programs, its description, its commands."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from twin.cli.main import run
from twin.rom.artefact import read_artefact

PAGE = Path(__file__).parents[2] / "docs" / "tutorial.md"


def steps() -> Iterator[tuple[str, str]]:
    """("python", program), ("toml", description) or ("twin", command) in the order of the page."""
    for found in re.finditer(
        r"^```(python|toml)\n(.*?)^```$|^    (twin [^\n]*)$", PAGE.read_text("utf-8"), re.M | re.S
    ):
        yield (found[1], found[2]) if found[1] else ("twin", found[3])


def test_the_page_has_all_steps():
    kinds = [kind for kind, _ in steps()]
    assert kinds.count("python") == 3
    assert kinds.count("toml") == 1
    commands = [shlex.split(text)[1] for kind, text in steps() if kind == "twin"]
    assert commands[:3] == ["check", "build", "verify"]
    assert commands[-1] == "calibrate"


@pytest.mark.long
def test_the_tutorial_leads_to_a_corrected_tool(tmp_path, monkeypatch):
    gmsh = pytest.importorskip("gmsh", exc_type=ImportError)
    try:
        gmsh.initialize()
        gmsh.finalize()
    except (OSError, AttributeError):
        pytest.skip("gmsh lacks its libraries")
    monkeypatch.chdir(tmp_path)
    for kind, text in steps():
        if kind == "python":
            done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stderr
        elif kind == "toml":
            Path("machine.toml").write_text(text, encoding="utf-8")
        else:
            assert run(shlex.split(text)[1:]) == 0, text
    assert read_artefact(Path("tutorial.h5")).certificate["passed"]
    assert json.loads(Path("offsets.json").read_text(encoding="utf-8"))
    (gain,) = (p for p in read_artefact(Path("calibrated.h5")).parameters if p.path == "sources.motor.gain")
    assert gain.nominal == pytest.approx(1.5, rel=0.05)  # 180 W of 120 W
