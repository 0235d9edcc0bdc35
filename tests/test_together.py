"""A reader never takes a result apart while another process replaces it."""

from __future__ import annotations

import hashlib
import json
import os
import threading

import pytest

from twin.errors import TwinError
from twin.together import result_h5


def put(folder, content, name="result.h5"):
    temporary = folder / "new"
    temporary.write_bytes(content)
    os.replace(temporary, folder / name)


def summary(content):
    return json.dumps({"files": {"result.h5": hashlib.sha256(content).hexdigest()}}).encode()


def test_a_result_that_is_whole_is_taken_at_once(tmp_path):
    put(tmp_path, b"old")
    assert result_h5(tmp_path, wait=0.0) == tmp_path / "result.h5"  # no summary beside it: moved here
    put(tmp_path, summary(b"old"), "summary.json")
    assert result_h5(tmp_path / "result.h5", wait=0.0).read_bytes() == b"old"


def test_a_reader_waits_until_the_last_file_is_replaced(tmp_path):
    put(tmp_path, b"old")
    put(tmp_path, summary(b"old"), "summary.json")
    put(tmp_path, b"new")
    finish = threading.Timer(0.2, put, (tmp_path, summary(b"new"), "summary.json"))
    finish.start()
    assert result_h5(tmp_path).read_bytes() == b"new"
    assert json.loads((tmp_path / "summary.json").read_bytes()) == json.loads(summary(b"new"))
    finish.join()


def test_files_of_two_results_are_refused(tmp_path):
    put(tmp_path, b"new")
    put(tmp_path, summary(b"old"), "summary.json")
    with pytest.raises(TwinError, match=r"not the result that summary.json beside it is of"):
        result_h5(tmp_path, wait=0.1)
