"""Shared by all tests: thread counts, a cache of built models, and the machines everybody tests on."""

from __future__ import annotations

import os
from pathlib import Path

from tests.browser import chromium, shown  # noqa: F401 - fixtures
from tests.golden.pinned import PINNED

# Before numpy is imported anywhere: golden values need the same instruction set on every processor, and on two cores
# the threads of BLAS fight the test workers and each other.
for variable, value in PINNED.items():
    os.environ.setdefault(variable, value)
# Tests that step spend most of their time in XLA's compiler, on code that runs for milliseconds: without its costly
# passes they take two thirds of it. Golden values are computed with these, in processes of their own.
os.environ["XLA_FLAGS"] += " --xla_backend_optimization_level=0"

ROOT = Path(__file__).parents[1]
# Test workers are the parallelism here: helpers beside them import and compile all that they need once more. Tests of
# helpers ask for two (tests/build/test_workers.py, tests/diagnose/test_over_runs.py): no digit depends on their number.
os.environ.setdefault("TWIN_WORKERS", "1")
# Builds are keyed by their inputs and by the code that makes them: a second test run finds them here.
os.environ.setdefault("TWIN_CACHE", str(ROOT / ".cache" / "tests"))

import pytest  # noqa: E402 - after the threads are set

FIRST = ("hidden", "golden")  # folders with tests that take minutes: what takes longest must not start last


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: item.path.parent.name not in FIRST)


@pytest.fixture(scope="session")
def slide_artefact(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A.h5 of the small machine, built with few scenarios; do not write to it."""
    from twin.build.pipeline import BuildOptions
    from twin.build.product import build_artefact
    from twin.build.rich_basis import RichOptions

    path = tmp_path_factory.mktemp("slide") / "slide.h5"
    options = BuildOptions(states=120, training=4, held_out=2, hours=1.0, rich=RichOptions(samples=6))
    build_artefact(ROOT / "tests" / "machines" / "slide", path, options)
    return path


@pytest.fixture(scope="session")
def slide_result(slide_artefact: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that `twin run` leaves for the small machine's short run; do not write to it."""
    from twin.logs.read import read_run
    from twin.rom.artefact import read_artefact
    from twin.run.replay import replay
    from twin.run.results import write_results

    folder = tmp_path_factory.mktemp("slide_result")
    run = read_run(ROOT / "tests" / "machines" / "slide" / "runs" / "short")
    write_results(folder, replay(read_artefact(slide_artefact), run), {})
    return folder
