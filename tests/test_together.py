"""A reader never takes a result apart while another process replaces it."""

from __future__ import annotations

import hashlib
import json
import os
import threading

import pytest

from twin.errors import TwinError
from twin.together import open_result


def put(folder, content, name="result.h5"):
    temporary = folder / "new"
    temporary.write_bytes(content)
    os.replace(temporary, folder / name)


def summary(content, **more):
    return json.dumps({"files": {"result.h5": hashlib.sha256(content).hexdigest()}} | more).encode()


def read(path, wait=5.0):
    with open_result(path, wait) as (file, told):
        return file.read(), told


def test_a_result_that_is_whole_is_taken_at_once(tmp_path):
    put(tmp_path, b"old")
    assert read(tmp_path, wait=0.0) == (b"old", {})  # no summary beside it: moved here
    put(tmp_path, summary(b"old", run="a"), "summary.json")
    content, told = read(tmp_path / "result.h5", wait=0.0)
    assert (content, told["run"]) == (b"old", "a")
    put(tmp_path, b'{"run": "b"}', "summary.json")  # of an older version
    assert read(tmp_path, wait=0.0) == (b"old", {"run": "b"})


def test_a_reader_waits_until_the_last_file_is_replaced(tmp_path):
    put(tmp_path, b"old")
    put(tmp_path, summary(b"old", run="a"), "summary.json")
    put(tmp_path, b"new")
    finish = threading.Timer(0.2, put, (tmp_path, summary(b"new", run="b"), "summary.json"))
    finish.start()
    content, told = read(tmp_path)
    assert (content, told["run"]) == (b"new", "b")
    finish.join()


def test_what_is_open_is_of_one_result_however_often_it_is_replaced(tmp_path):
    """What a reader takes from the file and from the summary, a `with` long, is of one result."""
    stop = threading.Event()

    def replace():
        k = 0
        while not stop.is_set():
            k += 1
            put(tmp_path, str(k).encode() * 5000)
            put(tmp_path, summary(str(k).encode() * 5000, run=str(k)), "summary.json")
            stop.wait(0.005)

    put(tmp_path, b"0")
    put(tmp_path, summary(b"0", run="0"), "summary.json")
    writer = threading.Thread(target=replace)
    writer.start()
    seen = set()
    try:
        while len(seen) < 5:  # the reader sees many of them
            with open_result(tmp_path) as (file, told):
                assert file.read() == told["run"].encode() * (5000 if told["run"] != "0" else 1)
                seen.add(told["run"])
    finally:
        stop.set()
        writer.join()


def test_files_of_two_results_are_refused(tmp_path):
    put(tmp_path, b"new")
    put(tmp_path, summary(b"old"), "summary.json")
    with pytest.raises(TwinError, match=r"not the result that summary.json beside it is of"):
        read(tmp_path, wait=0.1)


def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "result.h5")
    with pytest.raises(OSError, match="pipe"):
        read(tmp_path)
    os.replace(tmp_path / "result.h5", tmp_path / "summary.json")
    put(tmp_path, b"old")
    assert read(tmp_path) == (b"old", {})
