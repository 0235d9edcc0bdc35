"""Segments in run.toml: read in the order of time, refused where they overlap, are empty or lie outside the log."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.logs.test_read import write
from tests.logs.test_write import RUN
from twin.errors import LogError
from twin.logs.read import _KEYS as KEYS
from twin.logs.read import read_run
from twin.logs.run import Segment
from twin.logs.write import write_run

LOADS = "time [s],x [mm]\n0,1\n3600,2\n7200,3\n"


def test_segments_and_tcp_reference_are_read_in_si(tmp_path):
    text = (
        'tcp_reference = "first"\n'
        'segments = [{ name = "cooling", start = "1 h", end = "2 h" }, { name = "heating", start = 0, end = 3600.0 }]'
    )
    run = read_run(write(tmp_path, LOADS, run=text))
    assert run.segments == (Segment("heating", 0.0, 3600.0), Segment("cooling", 3600.0, 7200.0))
    assert run.tcp_reference == "first"
    plain = read_run(write(tmp_path, LOADS, run=""))
    assert (plain.segments, plain.tcp_reference) == ((), "absolute")


def test_segments_come_back_as_written(tmp_path):
    segments = (Segment('heat "up"', 0.0, 100.1), Segment("kühlen", 100.1, 360.0))
    write_run(tmp_path / "run", replace(RUN, segments=segments, tcp_reference="first"))
    back = read_run(tmp_path / "run")
    assert (back.segments, back.tcp_reference) == (segments, "first")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("segments = 3", "segments is no list of tables"),
        ("segments = [3]", "segments is no list of tables"),
        ('segments = [{ name = "a", start = 0 }]', "segments[0]: no end"),
        ('segments = [{ nme = "a", start = 0, end = 1 }]', "did you mean 'name'?"),
        ('segments = [{ name = "", start = 0, end = 1 }]', "name is no text"),
        ('segments = [{ name = "a", start = "0 m", end = 1 }]', "start: '0 m' is not a quantity in s"),
        ('segments = [{ name = "a", start = 60, end = 60 }]', "'a' is empty"),
        ('segments = [{ name = "a", start = -60, end = 60 }]', "lies outside the loads, 0 .. 7200 s"),
        ('segments = [{ name = "a", start = 7200, end = 9000 }]', "lies outside the loads"),
        ('segments = [{ name = "a", start = 0, end = "40 h" }]', "lies outside the loads"),
        (
            'segments = [{ name = "a", start = 0, end = 60 }, { name = "b", start = 30, end = 90 }]',
            "'a' and 'b' overlap between 30 and 60 s",
        ),
        (
            'segments = [{ name = "a", start = 0, end = 60 }, { name = "a", start = 60, end = 90 }]',
            "2 segments are called 'a'",
        ),
        ('tcp_reference = "last"', 'write "absolute", or "first"'),
    ],
)
def test_wrong_segments_are_refused(tmp_path, text, says):
    with pytest.raises(LogError) as caught:
        read_run(write(tmp_path, LOADS, run=text))
    assert says in str(caught.value)
    assert all("run.toml" in p.where and p.remedy for p in caught.value.problems)


def test_a_segment_may_end_with_the_step_after_the_last_row(tmp_path):
    text = 'segments = [{ name = "all", start = 0, end = 7260 }]'
    assert read_run(write(tmp_path, LOADS, run=text)).segments[0].end == 7260.0


def test_every_key_of_run_toml_is_documented():
    text = (Path(__file__).parents[2] / "docs" / "run_folder.md").read_text()
    assert [key for key in KEYS if f"| `{key}` |" not in text] == []
