"""The frozen page of a small machine."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.page.finished import finished_told
from twin.page.front import write_page
from twin.rom.artefact import read_artefact


@pytest.fixture(scope="session")
def frozen(slide_artefact: Path, slide_result: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    """Address of the frozen page of a run of the small machine."""
    path = tmp_path_factory.mktemp("frozen") / "index.html"
    write_page(path, finished_told(read_artefact(slide_artefact), slide_result))
    return path.as_uri()
