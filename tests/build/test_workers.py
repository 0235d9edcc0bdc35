"""Pieces of work over several processes: the same answer as in one, and nothing left behind."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from tests.build.two_bodies import model
from twin.build import workers
from twin.build.comparison import compare
from twin.build.scenario import draw
from twin.build.workers import each
from twin.errors import ModelError


def scaled(shared, item):
    """What the pieces of these tests do; also says in which process."""
    if item == -13:
        raise ModelError("thirteen", "item", "take another")
    if item == -77:
        os._exit(1)
    time.sleep(0.05)
    return os.getpid(), np.cos(shared * item)


def meet(folder, item):
    """The first piece waits until two processes have worked."""
    (folder / str(os.getpid())).touch()
    deadline = time.monotonic() + 60.0
    while item == 0 and len(list(folder.iterdir())) < 2:
        assert time.monotonic() < deadline, "no second process came"
        time.sleep(0.01)
    return item, np.cos(np.linspace(0.0, item, 1000)).tobytes()


@pytest.fixture
def two(monkeypatch):
    monkeypatch.setenv("TWIN_WORKERS", "2")


def test_results_come_in_order_from_several_processes(two, tmp_path):
    reported = []
    many = each(meet, tmp_path, list(range(60)), reported.append, long=0.0)
    assert many == [(i, np.cos(np.linspace(0.0, i, 1000)).tobytes()) for i in range(60)]
    assert sorted(reported) == list(range(60))
    assert len(list(tmp_path.iterdir())) == 2


def test_a_comparison_is_the_same_to_the_last_bit_in_two_processes(monkeypatch):
    full = model()
    coarse = replace(full, bodies=tuple(replace(b, E=1.01 * b.E) for b in full.bodies))
    scenarios = [draw(full.load_model, seed, hours=0.5) for seed in range(4)]
    told = []
    for wanted in ("1", "2"):
        monkeypatch.setenv("TWIN_WORKERS", wanted)
        result = compare(full, coarse, scenarios, 2, long=0.0)
        told.append([np.asarray(v).tobytes() for v in vars(result).values()])
        assert result.temperature_error.max() > 1e-3
    assert told[0] == told[1]


class _Caching:
    """Changes itself while it works, as a cached property does."""

    def read(self, name: str) -> str:
        if name not in vars(self):
            for k in range(2000):
                vars(self)[f"{name}_{k}"] = k
        return vars(self).setdefault(name, name)


def _read(shared: _Caching, name: str) -> str:
    return shared.read(name)


def test_what_is_shared_may_be_cached_into_while_helpers_start(two):
    names = [f"n{i}" for i in range(200)]
    assert each(_read, _Caching(), names, long=0.0) == names


def test_short_work_stays_here(two):
    assert {pid for pid, _ in each(scaled, np.ones(3), list(range(5)))} == {os.getpid()}
    assert each(scaled, 1.0, []) == []


def test_one_worker_is_this_process(monkeypatch):
    monkeypatch.setenv("TWIN_WORKERS", "1")
    assert {pid for pid, _ in each(scaled, np.ones(3), list(range(5)), long=0.0)} == {os.getpid()}


def test_errors_of_a_helper_arrive_here(two):
    items = [*range(40), -13, -13, -13, -13]
    with pytest.raises(ModelError, match="thirteen"):
        each(scaled, 1.0, items, long=0.0)


def test_a_helper_that_dies_is_told(two, monkeypatch):
    monkeypatch.setattr(workers, "_Helper", _Doomed)
    with pytest.raises(ModelError, match="has ended"):
        each(scaled, 1.0, list(range(60)), long=0.0)


class _Doomed(workers._Helper):
    """Its process gets an item that ends it."""

    def ask(self, item):
        return super().ask(-77)


def test_an_interrupt_ends_the_helpers():
    """They are children of a process that is interrupted, and must not outlive it."""
    code = (
        "import os, signal, sys\n"
        "from tests.build.test_workers import scaled\n"
        "from twin.build.workers import each, _Helper\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # what runs in the background inherits none
        "start = _Helper.__init__\n"
        "def told(self):\n"
        "    start(self)\n"
        "    print(self._process.pid, flush=True)\n"
        "_Helper.__init__ = told\n"
        "each(scaled, 1.0, list(range(2000)), long=0.0)\n"
    )
    environment = os.environ | {"TWIN_WORKERS": "2"}
    caller = subprocess.Popen([sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, text=True)
    helper = int(caller.stdout.readline())
    time.sleep(0.5)
    caller.send_signal(2)
    assert caller.wait(timeout=30) != 0
    with pytest.raises(ProcessLookupError):
        os.kill(helper, 0)


@pytest.mark.parametrize("wanted", ["0", "-1", "many"])
def test_a_number_of_processes_is_positive(wanted, monkeypatch):
    monkeypatch.setenv("TWIN_WORKERS", wanted)
    with pytest.raises(ModelError, match="no number of processes"):
        workers.workers()
