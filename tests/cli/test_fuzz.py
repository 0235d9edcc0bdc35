"""Damaged descriptions, artefacts and run folders by the hundred: a documented exit status, no traceback and no hang.

TWIN_FUZZ sets how many of each kind; every case is drawn from its own number, so that one can be had again:
TWIN_FUZZ_FIRST begins there.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.support.descriptions import SLIDE
from tests.support.fuzz import damaged_bytes, damaged_text, edit_artefact
from twin.cli.main import run

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

import synthetic
import synthetic_run

COUNT = int(os.environ.get("TWIN_FUZZ", "40"))
FIRST = int(os.environ.get("TWIN_FUZZ_FIRST", "0"))
SECONDS = 60  # of one case, on a computer with much else to do; most take a tenth of one
STATUS = (0, 1, 2, 130)
MODEL = synthetic.machine(2)
SPINDLE = SLIDE.parents[1] / "spindle" / "machine.toml"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("default::RuntimeWarning:twin"),  # as users have it; a warning is no wrong number
]


class Hang(Exception):
    """A case took too long."""


@contextmanager
def at_most(seconds: int) -> Iterator[None]:
    def ring(*_: object) -> None:
        raise Hang

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def called(*arguments: object) -> int:
    """The exit status of a command; raises what would be a traceback."""
    with at_most(SECONDS):
        return run([str(a) for a in arguments])


def each(kind: str, case: Callable[[random.Random], int], capsys: pytest.CaptureFixture) -> Counter[int]:
    """How often each status came of the cases of a kind."""
    found: Counter[int] = Counter()
    failed = []
    for number in range(FIRST, FIRST + COUNT):
        try:
            status = case(random.Random(f"{kind} {number}"))
        except BaseException as e:
            if isinstance(e, KeyboardInterrupt):
                raise
            failed.append(f"{kind} {number}: {type(e).__name__}: {str(e)[:200]}")
            continue
        finally:
            told = capsys.readouterr()
        found[status] += 1
        if status not in STATUS or "Traceback" in told.err + told.out:
            failed.append(f"{kind} {number}: exit {status}")
        elif status in (1, 2) and not told.out + told.err:
            failed.append(f"{kind} {number}: exit {status} without a word")
    assert not failed, "\n".join(failed)
    return found


def test_descriptions(tmp_path, capsys):
    texts = [path.read_text(encoding="utf-8") for path in (SLIDE, SPINDLE)]
    path = tmp_path / "machine.toml"

    def case(rng: random.Random) -> int:
        path.write_text(damaged_text(rng.choice(texts), rng), encoding="utf-8", newline="")
        status = called("check", "--no-meshes", path)
        if status == 0:  # what is found sound is evaluated
            assert called("losses", path) in (0, 2)
        return status

    found = each("description", case, capsys)
    assert found[2] > COUNT // 4


@pytest.fixture(scope="module")
def artefact(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return synthetic_run.artefact(tmp_path_factory.mktemp("a") / "a.h5", MODEL)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return synthetic_run.run_folder(tmp_path_factory.mktemp("r") / "run", MODEL, hours=0.5)


@pytest.fixture(scope="module")
def right(artefact, folder, tmp_path_factory) -> np.ndarray:
    out = tmp_path_factory.mktemp("right")
    assert run(["run", str(artefact), str(folder), "-o", str(out)]) == 0
    return temperatures(out)


def temperatures(out: Path) -> np.ndarray:
    with h5py.File(out / "result.h5") as f:
        return f["temperature"][...]


def judged(out: Path) -> None:
    """A result that was given out: finite, its heat in balance; flagged where it is beyond what was certified."""
    told = json.loads((out / "summary.json").read_text())
    found = temperatures(out)
    assert np.isfinite(found).all()
    assert told["heat"]["max_balance_error"] < 1e-6
    if np.abs(found - 20.0).max() > 100.0:  # the loads of the synthetic machine within their ranges: 60 K
        assert told["flagged_steps"]


def test_artefacts_with_flipped_bits(artefact, folder, right, tmp_path, capsys):
    content, path, out = artefact.read_bytes(), tmp_path / "a.h5", tmp_path / "out"

    def case(rng: random.Random) -> int:
        path.write_bytes(damaged_bytes(content, rng))
        status = called("run", path, folder, "-o", out)
        if status == 0:  # nothing that is read has changed
            assert np.array_equal(temperatures(out), right)
        return status

    found = each("flipped", case, capsys)
    assert found[2] > COUNT // 2
    assert found[1] == 0


def test_artefacts_that_were_edited_and_hashed_anew(artefact, folder, tmp_path, capsys):
    path, out = tmp_path / "a.h5", tmp_path / "out"

    def case(rng: random.Random) -> int:
        shutil.copy(artefact, path)
        edit_artefact(path, rng)
        status = called("run", path, folder, "-o", out)
        if status == 0:
            judged(out)
            assert called("info", path) == 0
        return status

    found = each("edited", case, capsys)
    assert found[2] > COUNT // 4


def test_run_folders(artefact, folder, tmp_path, capsys):
    copy, out = tmp_path / "run", tmp_path / "out"

    def case(rng: random.Random) -> int:
        shutil.rmtree(copy, ignore_errors=True)
        shutil.copytree(folder, copy)
        path = copy / rng.choice(("run.toml", "loads.csv", "loads.csv"))
        path.write_text(damaged_text(path.read_text(), rng), encoding="utf-8", newline="")
        checked = called("check", copy, "--machine", artefact)
        status = called("run", artefact, copy, "-o", out)
        assert checked == 0 or status == 2  # what the check refuses, every verb does
        if status == 0:
            judged(out)
        return status

    found = each("folder", case, capsys)
    assert found[2] > COUNT // 4
