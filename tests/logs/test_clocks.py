"""The rhythm of a log: restarts, lost rows, rows on change only, clocks that count from elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from tests.logs.test_check import SPEED, TIME, WAVE, found, table
from tests.logs.test_read import write
from twin.logs.check import check_run
from twin.logs.read import parse_run

COLUMNS = {"x [m]": WAVE, "v [m/s]": SPEED}


@pytest.mark.parametrize(
    ("jump", "says"),
    [
        (-(2.0**32) / 1e3, "as a 32-bit or 16-bit counter of milliseconds does"),
        (-3600.0, "by an hour, from 2.59e+04 to 2.23e+04 s, as at a clock change"),
    ],
)
def test_a_clock_that_jumps_back(tmp_path, jump, says):
    time = 25_400.0 + TIME + (2.0**32 / 1e3 if jump < -1e6 else 0.0)
    time[101:] += jump
    if jump == -3600.0:
        time = np.concatenate([np.arange(0.0, 25_400.0, 200.0), time])
    columns = {name: np.resize(values, len(time)) for name, values in COLUMNS.items()}
    problems = found(tmp_path, {"time [s]": time, **columns}, run="")
    (error,) = [p for p in problems if not p.warning]
    assert "time runs backwards, once" in error.what
    if jump < -1e6:
        assert says in error.what
    else:
        assert "by an hour" in error.what
    assert f"(line {int(np.argmin(np.diff(time))) + 3})" in error.where


def test_lost_rows_of_a_regular_log(tmp_path):
    keep = np.ones(200, dtype=bool)
    keep[[50, 51, 120]] = False
    (gap,) = found(tmp_path, {"time [s]": TIME[keep], **{k: v[keep] for k, v in COLUMNS.items()}})
    assert gap.what == "2 times a gap, the longest 15 s where 5 s are usual, 3 rows missing"
    assert gap.where.endswith("(lines 52, 120)")  # the rows after the gaps


def test_a_row_off_the_beat(tmp_path):
    time = TIME.copy()
    time[70] += 2.0
    (off,) = found(tmp_path, {"time [s]": time, **COLUMNS})
    assert "stand 3 .. 7 s apart" in off.what
    assert off.where.endswith("(lines 72, 73)")


def test_jitter_is_no_finding(tmp_path):
    rng = np.random.default_rng(3)
    time = TIME + rng.uniform(-0.2, 0.2, len(TIME))
    assert found(tmp_path, {"time [s]": time, **COLUMNS}) == []


def test_rows_only_where_something_changes(tmp_path):
    """Two slow channels with dead bands, merged row by row; the same at a fixed rate is silent."""
    rng = np.random.default_rng(1)
    time = np.cumsum(rng.exponential(5.0, 300))
    first = rng.random(300) < 0.5
    a, b = (np.cumsum(np.where(move, 0.1, 0.0)) for move in (first, ~first))
    (told,) = found(tmp_path, {"time [s]": time, "a [W]": 100 + a, "b [W]": 100 + b}, run="")
    assert told.warning
    assert "only where something changes" in told.what
    assert "heartbeat" in told.remedy
    longest = int(np.argmax(np.diff(time)))
    assert told.where.endswith(f"(lines {longest + 2} .. {longest + 3})")
    assert found(tmp_path, {"time [s]": 5.0 * np.arange(300), "a [W]": 100 + a, "b [W]": 100 + b}, run="") == []


@pytest.mark.parametrize("factor", [60.0, 1000.0, 1 / 60.0, 3600.0])
def test_rate_a_usual_slip_away_from_the_stated_one_is_an_error(tmp_path, factor):
    (told,) = [p for p in found(tmp_path, {"time [s]": TIME * factor, "x [m]": WAVE}) if not p.warning]
    assert "run.toml says 5 s" in told.what


@pytest.mark.parametrize("factor", [2.0, 10.0])
def test_other_rates_are_warned_of(tmp_path, factor):
    (told,) = found(tmp_path, {"time [s]": TIME * factor, "x [m]": WAVE})
    assert told.warning
    assert "run.toml says 5 s" in told.what


@pytest.mark.parametrize(
    ("time", "says"),
    [
        (TIME + 1.77e9, "times begin 1770000000 s from the start"),
        (TIME - 3600.0, "3600 s before the start in run.toml (a whole hour: is a zone wrong?)"),
        (TIME + 7200.0, "7200 s after the start in run.toml (a whole hour: is a zone wrong?)"),
    ],
)
def test_times_that_count_from_elsewhere(tmp_path, time, says):
    text = table({"time [s]": time, **COLUMNS})
    rows = [f"{t:.1f}" for t in time]
    lines = text.split("\n")
    lines[1:] = [",".join([t, *line.split(",")[1:]]) for t, line in zip(rows, lines[1:], strict=True)]
    (told,) = check_run(parse_run(write(tmp_path, "\n".join(lines))))
    assert says in told.what
    assert told.where.endswith("(line 2)")


def test_r_tests_come_when_they_come(tmp_path):
    """No beat is asked of tcp.csv, and one moment may hold several places, but not the same place twice."""
    tcp = "time [s],x [mm],dx [um],dy [um],dz [um]\n60,1,1,1,1\n60,2,1,1,1\n70,1,1,1,1\n700,1,1,1,1\n"
    assert found(tmp_path, {"time [s]": TIME, **COLUMNS}, tcp=tcp) == []
    (told,) = found(tmp_path, {"time [s]": TIME, **COLUMNS}, tcp=tcp.replace("60,2", "60,1"))
    assert not told.warning
    assert "the same time twice, once, with equal values" in told.what
