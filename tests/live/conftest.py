"""The small lumped machine, built and compiled once for all tests of the process beside it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from twin.build.pipeline import BuildOptions
from twin.build.product import build_artefact
from twin.build.rich_basis import RichOptions

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def spindle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A.h5 of the spindle; do not write to it."""
    path = tmp_path_factory.mktemp("spindle") / "a.h5"
    options = BuildOptions(training=2, held_out=1, hours=0.5, rich=RichOptions(samples=3))
    build_artefact(ROOT / "tests" / "machines" / "spindle", path, options)
    return path


@pytest.fixture(scope="session")
def compiled(spindle: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that its C engine is kept in."""
    from twin.live.opened import open_engine

    folder = tmp_path_factory.mktemp("engine")
    open_engine(spindle, "c", folder)
    return folder


@pytest.fixture
def state(compiled: Path, tmp_path: Path) -> Path:
    """An empty state folder in which the C engine is compiled already."""
    folder = tmp_path / "state"
    shutil.copytree(compiled, folder / "engine")
    return folder
