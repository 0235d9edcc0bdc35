"""A machine without meshes, which is built in a second."""

from __future__ import annotations

from pathlib import Path

import pytest

import twin

SPINDLE = Path(__file__).parents[1] / "machines" / "spindle"


@pytest.fixture(scope="session")
def lumped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A.h5 of the spindle of the tests; do not write to it."""
    path = tmp_path_factory.mktemp("lumped") / "spindle.h5"
    twin.build(SPINDLE, options=twin.BuildOptions(held_out=1)).save(path)
    return path
