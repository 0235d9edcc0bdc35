"""What is written reads back, whole or not at all, and measured data are never destroyed."""

from __future__ import annotations

import errno
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from twin.errors import LogError, TwinError
from twin.logs import write as write_module
from twin.logs.read import read_run
from twin.logs.run import Run, Table, Tcp
from twin.logs.write import write_run

TIME = np.arange(7) * 60.0
RUN = Run(
    loads=Table(TIME, {"x": np.linspace(-0.4, 0.4, 7), "i": np.full(7, np.pi)}, {"x": "m", "i": "A"}),
    temperatures=Table(
        TIME,
        {"bed": 20 + TIME / 1e4, "air": np.array([20, np.nan, 21, 21, 21, 21, 22.0])},
        {"bed": "degC", "air": "degC"},
    ),
    tcp=Tcp(
        TIME[:2],
        ("x", "y"),
        np.array([[0.1, -0.2], [0.3, 0.0]]),
        np.array([[1e-6, 2e-6, -3e-6], [0, 1e-9, 4e-5]]),
        np.full(2, 5e-7),
    ),
    start=datetime.fromisoformat("2026-03-02T08:00:00+01:00"),
    zone="Europe/Berlin",
    sampling=60.0,
    provenance='simulated "by hand"\nin two lines: ü',
    synthetic=("loads", "temperatures", "tcp"),
    initial_temperature=20.5,
    machine="../machine.toml",
)


def test_a_run_comes_back_as_written(tmp_path):
    write_run(tmp_path / "run", RUN)
    back = read_run(tmp_path / "run")
    for field in ("start", "zone", "sampling", "provenance", "synthetic", "initial_temperature", "machine"):
        assert getattr(back, field) == getattr(RUN, field)
    for name in ("loads", "temperatures"):
        ours, theirs = getattr(RUN, name), getattr(back, name)
        assert theirs.units == ours.units
        np.testing.assert_allclose(theirs.time, ours.time)
        for column, values in ours.columns.items():
            np.testing.assert_allclose(theirs.columns[column], values, rtol=1e-8)
    assert back.tcp.axes == ("x", "y")
    np.testing.assert_allclose(back.tcp.position, RUN.tcp.position, rtol=1e-8)
    np.testing.assert_allclose(back.tcp.displacement, RUN.tcp.displacement, rtol=1e-8)
    np.testing.assert_allclose(back.tcp.sigma, RUN.tcp.sigma, rtol=1e-8)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["run"]


def test_computed_runs_are_replaced_whole(tmp_path):
    write_run(tmp_path / "run", RUN)
    write_run(tmp_path / "run", replace(RUN, tcp=None))
    assert sorted(p.name for p in (tmp_path / "run").iterdir()) == ["loads.csv", "run.toml", "temperatures.csv"]


def test_measured_runs_and_other_folders_are_not(tmp_path):
    write_run(tmp_path / "run", replace(RUN, synthetic=()))
    with pytest.raises(LogError, match="measured data"):
        write_run(tmp_path / "run", RUN)
    assert read_run(tmp_path / "run").synthetic == ()
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(LogError):
        write_run(tmp_path, RUN)
    assert (tmp_path / "notes.txt").read_text() == "mine"
    with pytest.raises(LogError):
        write_run(tmp_path / "notes.txt", RUN)


@pytest.mark.parametrize("failure", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
def test_full_disk_and_ctrl_c_leave_the_old_run_and_nothing_else(tmp_path, monkeypatch, failure):
    write_run(tmp_path / "run", RUN)
    before = (tmp_path / "run" / "loads.csv").read_bytes()

    def fail(path: Path, tcp: Tcp) -> None:
        path.write_text("half")
        raise failure

    monkeypatch.setattr(write_module, "write_tcp", fail)
    with pytest.raises((TwinError, KeyboardInterrupt)) as caught:
        write_run(tmp_path / "run", replace(RUN, loads=replace(RUN.loads, time=TIME + 1)))
    if isinstance(failure, OSError):
        assert "No space left" in str(caught.value)
        assert "free disk space" in str(caught.value)
    assert (tmp_path / "run" / "loads.csv").read_bytes() == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["run"]
