"""Entries of the cache: made again when anything that decides has changed or is damaged, removed by use."""

from __future__ import annotations

import hashlib
import logging
import os
import pickle
import subprocess
import sys
import threading

import numpy as np
import pytest

from twin.build import cache
from twin.build.cache import arrays_hash, cached
from twin.build.cache_file import read_entry, write_entry
from twin.build.full_model import SurfaceMesh
from twin.errors import ModelError

MODULE = "twin.build.full_model"
ALL = 10**9


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("TWIN_CACHE", str(tmp_path))
    monkeypatch.delenv("TWIN_CACHE_BYTES", raising=False)
    return tmp_path


@pytest.fixture
def notices(caplog):
    caplog.set_level(logging.WARNING)
    return lambda: [record.getMessage() for record in caplog.records]


class Maker:
    """Makes a surface and counts how often."""

    def __init__(self, numbers: int = 300):
        self.times, self.numbers = 0, numbers

    def __call__(self) -> SurfaceMesh:
        self.times += 1
        return SurfaceMesh(np.linspace(0.0, 1.0, self.numbers), np.arange(6).reshape(2, 3))


def test_an_entry_is_made_once_and_equal_when_read():
    make = Maker()
    made, read = (cached("full", MODULE, ("a", 1.5), make) for _ in range(2))
    assert make.times == 1
    assert np.array_equal(made.points, read.points)
    assert np.array_equal(made.triangles, read.triangles)


def test_stage_module_code_and_inputs_decide(monkeypatch):
    make, code = Maker(), {}
    monkeypatch.setattr(cache, "closure_hash", lambda module: code.get(module, module))
    for stage, module, inputs in (("full", MODULE, (1,)), ("rich", MODULE, (1,)), ("full", "twin.units", (1,)),
                                  ("full", MODULE, (2,))):  # fmt: skip
        before = make.times
        for _ in range(2):
            cached(stage, module, inputs, make)
        assert make.times == before + 1
    code["twin.units"] = "edited"
    cached("full", MODULE, (1,), make)
    assert make.times == 4
    cached("full", "twin.units", (1,), make)
    assert make.times == 5


def test_arrays_are_distinguished_by_type_shape_and_place():
    a = np.arange(6.0)
    given = [[a], [a.reshape(2, 3)], [a.astype(np.float32)], [a[:3], a[3:]], [a[3:], a[:3]], []]
    assert len({arrays_hash(arrays) for arrays in given}) == len(given)
    assert arrays_hash([a[::2]]) == arrays_hash([a[::2].copy()])


def test_twenty_flipped_bytes_are_found_wherever_they_are(folder, notices):
    make, rng = Maker(), np.random.default_rng(7)
    expected = cached("full", MODULE, (), make)
    (path,) = folder.glob("full-*.npz")
    whole = path.read_bytes()
    for trial in range(1, 21):
        damaged = bytearray(whole)
        for place in rng.choice(len(whole), 20, replace=False):
            damaged[place] ^= int(rng.integers(1, 256))
        path.write_bytes(damaged)
        again = cached("full", MODULE, (), make)
        assert make.times == 1 + trial
        assert np.array_equal(again.points, expected.points)
        assert "\n" not in notices()[-1]
        assert path.name in notices()[-1]
        assert len(notices()) == trial
    cached("full", MODULE, (), make)
    assert make.times == 21


def test_every_single_flipped_byte_is_found(folder):
    path = folder / "entry.npz"
    write_entry(path, (1.0, "two"), ALL)
    whole = path.read_bytes()
    for place in range(len(whole)):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        with pytest.raises(ValueError, match="checksum"):
            read_entry(path)


def test_a_torn_or_empty_entry_is_made_again(folder):
    make = Maker()
    cached("full", MODULE, (), make)
    (path,) = folder.glob("full-*.npz")
    for times, size in enumerate((1000, 10, 0), start=2):
        path.write_bytes(path.read_bytes()[:size])
        cached("full", MODULE, (), make)
        assert make.times == times


class Hostile:
    """A pickle of it would make a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


def signed(content: bytes) -> bytes:
    """With the checksum that an attacker can make as well as we can."""
    return content + hashlib.sha256(content).digest()


def test_pickles_are_refused_and_made_again(folder, notices):
    make, planted = Maker(), folder / "planted"
    cached("full", MODULE, (), make)
    (path,) = folder.glob("full-*.npz")
    arrays = folder / "arrays.npz"
    np.savez(arrays, np.frombuffer(b'{"root": {"array": 0}, "objects": []}', np.uint8), np.array([Hostile(planted)]))
    for times, content in enumerate((pickle.dumps(Hostile(planted)), arrays.read_bytes()), start=2):
        path.write_bytes(signed(content))
        assert np.array_equal(cached("full", MODULE, (), make).points, Maker()().points)
        assert make.times == times
        assert not planted.exists()
        assert len(notices()) == times - 1
    pickle.loads(pickle.dumps(Hostile(planted)))
    assert planted.exists()  # the payload does work


def test_an_entry_that_names_a_class_of_another_package_is_made_again(folder, notices):
    make = Maker()
    cached("full", MODULE, (), make)
    (path,) = folder.glob("full-*.npz")
    body = path.read_bytes()[:-32]
    assert b"twin.build.full_model:SurfaceMesh" in body
    arrays = folder / "arrays.npz"
    np.savez(arrays, np.frombuffer(b'{"root": {"object": 0}, "objects": [["subprocess:Popen", ["true"]]]}', np.uint8))
    path.write_bytes(signed(arrays.read_bytes()))
    assert isinstance(cached("full", MODULE, (), make), SurfaceMesh)
    assert make.times == 2
    assert "no class of this package" in notices()[0]


def age(folder, stage: str, seconds: float) -> None:
    """Make the entry of a stage as if last used some time ago."""
    (path,) = folder.glob(f"{stage}-*")
    then = path.stat().st_mtime - seconds
    os.utime(path, (then, then))


def test_what_was_not_used_for_longest_goes_first_and_reading_is_use(folder, monkeypatch):
    monkeypatch.setenv("TWIN_CACHE_BYTES", "35000")  # three entries of 10 kB
    make = Maker(1250)
    for number, stage in enumerate(("one", "two", "three")):
        cached(stage, MODULE, (), make)
        age(folder, stage, 1000.0 - number)
    cached("one", MODULE, (), make)  # used again
    cached("four", MODULE, (), make)
    assert {p.name.partition("-")[0] for p in folder.glob("*.npz")} == {"one", "three", "four"}
    cached("five", MODULE, (), make)
    assert {p.name.partition("-")[0] for p in folder.glob("*.npz")} == {"one", "four", "five"}


def test_many_small_entries_do_not_push_out_a_large_one_that_is_used(folder, monkeypatch):
    monkeypatch.setenv("TWIN_CACHE_BYTES", "200000")
    large, small = Maker(12_500), Maker(500)
    for number in range(60):
        cached("detector", MODULE, (), large)
        cached("full", MODULE, (number,), small)
    assert (large.times, small.times) == (1, 60)
    assert 10 < len(list(folder.glob("full-*.npz"))) < 25
    assert sum(p.stat().st_size for p in folder.iterdir()) <= 200_000


def test_files_that_are_no_entries_stay_and_entries_of_older_versions_go(folder, monkeypatch):
    monkeypatch.setenv("TWIN_CACHE_BYTES", "35000")
    others = [folder / "recovery-3.npz", folder / "mesh-five_axis-0.03", folder / "detector.lock"]
    old = folder / f"full-{'0a' * 12}.pickle"
    for path in (*others, old):
        path.write_bytes(bytes(30_000))
    age(folder, "full", 100.0)
    cached("rich", MODULE, (), Maker(1250))
    assert all(path.exists() for path in others)
    assert not old.exists()


def test_an_entry_larger_than_the_budget_is_not_stored_and_pushes_nothing_out(folder, monkeypatch, notices):
    cached("full", MODULE, (), Maker())
    monkeypatch.setenv("TWIN_CACHE_BYTES", "35000")
    make = Maker(50_000)
    for _ in range(2):
        assert cached("rich", MODULE, (), make).points.size == 50_000
    assert make.times == 2
    assert [p.name.partition("-")[0] for p in folder.iterdir()] == ["full"]
    assert len(notices()) == 2
    assert "TWIN_CACHE_BYTES" in notices()[0]


def test_a_budget_that_is_no_number_is_an_error_before_anything_is_made(monkeypatch):
    monkeypatch.setenv("TWIN_CACHE_BYTES", "20 GB")
    make = Maker()
    with pytest.raises(ModelError, match="no number of bytes"):
        cached("full", MODULE, (), make)
    assert make.times == 0


def test_what_is_no_data_is_returned_and_not_kept(folder, notices):
    assert cached("full", MODULE, (), lambda: print) is print
    assert list(folder.iterdir()) == []
    assert "is not kept" in notices()[0]


def test_a_cache_that_cannot_be_written_costs_time_alone(tmp_path, monkeypatch, notices):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("TWIN_CACHE", str(tmp_path / "file" / "cache"))
    make = Maker()
    for _ in range(2):
        assert isinstance(cached("full", MODULE, (), make), SurfaceMesh)
    assert make.times == 2


def test_an_entry_removed_or_replaced_while_it_is_read_is_read_to_its_end(folder, monkeypatch):
    path = folder / "entry.npz"
    write_entry(path, np.arange(1000.0), ALL)
    read = np.load

    def load(file, **more):
        path.unlink()
        write_entry(path, np.zeros(5), ALL)
        return read(file, **more)

    monkeypatch.setattr(np, "load", load)
    assert np.array_equal(read_entry(path), np.arange(1000.0))
    monkeypatch.undo()
    assert np.array_equal(read_entry(path), np.zeros(5))


WRITE = """
import sys
import numpy as np
from pathlib import Path
from twin.build.cache_file import write_entry
print(flush=True)
sys.stdin.readline()
for _ in range(40):
    write_entry(Path(sys.argv[1]), np.full(20_000, 7.0), 10**9)
"""


def test_processes_that_write_the_same_entry_leave_a_whole_one_at_all_times(folder):
    path = folder / "entry.npz"
    write_entry(path, np.full(20_000, 7.0), ALL)
    writers = [
        subprocess.Popen([sys.executable, "-c", WRITE, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        for _ in range(2)
    ]
    for writer in writers:
        writer.stdout.readline()
    reads, done = 0, threading.Event()

    def wait() -> None:
        for writer in writers:
            writer.communicate(b"\n")
        done.set()

    waiting = threading.Thread(target=wait)
    for writer in writers:
        writer.stdin.write(b"\n")
        writer.stdin.flush()
    waiting.start()
    while not done.is_set():
        assert np.array_equal(read_entry(path), np.full(20_000, 7.0))
        reads += 1
    waiting.join()
    assert reads > 0
    assert [writer.returncode for writer in writers] == [0, 0]
    assert [p.name for p in folder.iterdir()] == ["entry.npz"]
