"""The slide machine built once through the command line, for the long system tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.cli.main import run

SLIDE = Path(__file__).parents[1] / "machines" / "slide"


@pytest.fixture(scope="session")
def built_artefact(tmp_path_factory):
    path = tmp_path_factory.mktemp("slide") / "slide.h5"
    assert run(["build", str(SLIDE / "machine.toml"), "-o", str(path), "--states", "150"]) == 0
    return path
