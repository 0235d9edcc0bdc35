"""The small lumped machine, built and compiled once for all tests of the process beside it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import twin

ROOT = Path(__file__).parents[2]
RUN = ROOT / "tests" / "machines" / "spindle" / "runs" / "warm_up"


@pytest.fixture(scope="session")
def spindle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A.h5 of the spindle; do not write to it."""
    path = tmp_path_factory.mktemp("spindle") / "a.h5"
    twin.build(ROOT / "tests" / "machines" / "spindle", options=twin.BuildOptions(held_out=1)).save(path)
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
