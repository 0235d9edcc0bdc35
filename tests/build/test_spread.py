"""Trials over the workers of a real Dask scheduler, one of which is killed while it works."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from twin.build.spread import spread
from twin.errors import ModelError

pytest.importorskip("distributed")
ROOT = Path(__file__).parents[2]
READY = 60.0  # s, within which a scheduler and its workers have started


def slow_square(shared: int, item: int) -> tuple[int, int]:
    """shared + item^2, and the process that said so."""
    time.sleep(0.3)
    return shared + item**2, os.getpid()


def _started(*command: str) -> subprocess.Popen[bytes]:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])}
    quiet = subprocess.DEVNULL
    return subprocess.Popen([sys.executable, "-m", *command], env=environment, cwd=ROOT, stdout=quiet, stderr=quiet)


@pytest.fixture
def cluster(tmp_path):
    """A scheduler with two workers, in processes of their own: its address, and the workers."""
    told = tmp_path / "scheduler.json"
    file = ("--scheduler-file", str(told))
    one = ("--nthreads", "1", "--nworkers", "1", "--no-nanny", "--no-dashboard", "--local-directory", str(tmp_path))
    at = ("--host", "127.0.0.1", "--port", "0", "--dashboard-address", "127.0.0.1:0")
    processes = [_started("distributed.cli.dask_scheduler", *at, *file)]
    try:
        processes += [_started("distributed.cli.dask_worker", *file, *one) for _ in range(2)]
        yield address(told), processes[1:]
    finally:
        for process in processes:
            process.kill()
            process.wait()


def address(told: Path) -> str:
    """Of a scheduler to which two workers have come."""
    from distributed import Client

    began = time.monotonic()
    while not told.exists() and time.monotonic() - began < READY:
        time.sleep(0.1)
    with Client(scheduler_file=str(told), timeout="30s") as client:
        client.wait_for_workers(2, timeout=READY)
        return str(client.scheduler.address)


@pytest.mark.long
def test_pieces_of_a_killed_worker_are_made_by_another_one(cluster, monkeypatch):
    where, workers = cluster
    monkeypatch.setenv("SCHEDULER", where)
    made: dict[int, tuple[int, int]] = {}

    def done(item: int, result: tuple[int, int]) -> None:
        assert item not in made
        made[item] = result
        if len(made) == 4:
            workers[0].send_signal(signal.SIGKILL)

    spread(slow_square, 100, range(20), done)
    assert {item: value for item, (value, _) in made.items()} == {i: 100 + i**2 for i in range(20)}
    assert {pid for _, pid in made.values()} <= {w.pid for w in workers}  # nothing was made here
    assert workers[0].wait(timeout=10) == -signal.SIGKILL
    assert len({pid for _, pid in list(made.values())[-6:]}) == 1


def test_without_a_scheduler_that_answers_the_address_is_told(monkeypatch):
    monkeypatch.setenv("SCHEDULER", "tcp://127.0.0.1:1")
    with pytest.raises(ModelError, match="no scheduler answers"):
        spread(slow_square, 100, range(2), lambda *_: None, patience=1.0)


def test_without_an_address_processes_of_this_computer_do_it(monkeypatch):
    monkeypatch.delenv("SCHEDULER", raising=False)
    made = {}
    spread(slow_square, 100, range(4), lambda item, result: made.setdefault(item, result[0]))
    assert made == {i: 100 + i**2 for i in range(4)}
