"""`twin warmup` as a user calls it, on results of a small artefact."""

from __future__ import annotations

import json
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.support import synthetic
from twin.cli.main import run
from twin.logs.run import Run, Table
from twin.logs.write import write_run
from twin.rom.artefact import write_artefact
from twin.rom.hdf5_file import put, put_attributes, scale, writing
from twin.run.results import FORMAT

TAU = 900.0


def result(path: Path, hours: float) -> Path:
    """A result.h5 whose TCP error goes to 40, -8, 0.3 um with one time constant, twice as far at pose 1."""
    time = np.arange(0.0, hours * 3600.0 + 1.0, 60.0)
    rise = 1.0 - np.exp(-time / TAU)
    actual = rise[:, None] * np.array([40e-6, -8e-6, 0.3e-6])
    with writing(path) as f:
        put_attributes(f, {"format": FORMAT, "artefact": "none", "substeps": 4})
        scale(f, "time", 1e4 + time, "s")
        scale(f, "sensor", ("motor", "bed"))
        scale(f, "pose_axis", ("x",))
        put(f, "pose_position", np.array([[-0.2], [0.2]]), "m")
        put(f, "temperature", np.column_stack([20.0 + 10.0 * rise, 20.0 + 1e-4 * time]), "degC")
        put(f, "tcp", np.stack([actual, 2.0 * actual], axis=1), "m")
        put(f, "tcp_actual", actual, "m")
    return path


def test_settled_table(tmp_path, capsys):
    result(tmp_path / "result.h5", hours=4.0)
    assert run(["warmup", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert f": TCP warm after {TAU / 60 * np.log(80.0):.0f} min" in out  # 80 exp(-t/tau) = 1 at pose 1
    rows = {line.split("  ")[0]: line for line in out.splitlines()[3:]}
    assert rows["dx at the actual position"].split()[5:8] == ["40.00", "um", "55"]
    assert "x 200 mm" in out
    assert rows["motor"].split()[1:7] == ["10.00", "K", "69", "min", "15", "min"]
    assert "not reached" in rows["bed"]
    assert "1 of 2 sensors settled within 0.1 K" in out.splitlines()[0]  # the verdict is that of the TCP only
    assert "+0.36 K/h" in rows["bed"]


def test_stopped_too_early_is_said(tmp_path, capsys):
    path = result(tmp_path / "result.h5", hours=0.5)
    assert run(["warmup", str(path)]) == 0
    out = capsys.readouterr().out
    assert "not settled after 30 min" in out
    name, drift = out.splitlines()[1].removeprefix("fastest drift at the end: ").rsplit(": ", 1)
    assert name == "dx at its worst pose, x 200 mm"
    (row,) = (line for line in out.splitlines()[2:] if line.startswith(name))
    assert row.endswith(f"  {drift}")  # the same number as in the table
    assert float(drift.split()[0]) > 10.0
    assert out.count("not reached") >= 4


def test_within_the_tolerance_at_the_last_sample_only_is_not_warm(tmp_path, capsys):
    path = result(tmp_path / "result.h5", hours=4.0)
    with h5py.File(path, "r+") as f:
        f["tcp"][-1, 1, 0] += 5e-6
    assert run(["warmup", str(path), "--horizon", "1 s"]) == 0
    out = capsys.readouterr().out
    assert "TCP not settled after 240 min" in out.splitlines()[0]
    (row,) = (line for line in out.splitlines() if line.startswith("dx at its worst pose"))
    assert "not reached" in row


def test_json_tells_when_it_settles(tmp_path, capsys):
    path = result(tmp_path / "result.h5", hours=4.0)
    assert run(["warmup", str(path), "--json", "--tolerance", "2 um"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["settled"], told["tolerance_m"], told["horizon_s"]) == (True, pytest.approx(2e-6), 3600.0)
    dx = told["tcp_actual"]["dx"]
    assert dx["time_s"] == pytest.approx(TAU * np.log(20.0), rel=2e-3)
    assert dx["t95_s"] == pytest.approx(-TAU * np.log(0.05), rel=2e-3)
    assert told["tcp_worst"]["dx"]["pose_m"] == {"x": 0.2}
    assert told["tcp_worst"]["dx"]["change_m"] == pytest.approx(80e-6, rel=1e-4)
    assert told["sensors"]["bed"]["time_s"] is None


def test_a_tighter_horizon_settles_a_drift(tmp_path, capsys):
    path = result(tmp_path / "result.h5", hours=4.0)
    assert run(["warmup", str(path), "--json", "--horizon", "10 min"]) == 0
    assert json.loads(capsys.readouterr().out)["sensors"]["bed"]["settled"]  # 0.06 K in 10 min


def test_bad_input_is_refused(tmp_path, capsys):
    path = result(tmp_path / "result.h5", hours=1.0)
    for arguments, told in (
        ([str(tmp_path / "nowhere")], "no result here"),
        ([str(path), "--tolerance", "1 K"], "--tolerance"),
        ([str(path), "--tolerance", "0 um"], "out of range"),
    ):
        assert run(["warmup", *arguments]) == 2
        assert told in capsys.readouterr().err
    with h5py.File(path, "r+") as f:
        f.attrs["format"] = "something else"
    assert run(["warmup", str(path)]) == 2
    assert "not a result" in capsys.readouterr().err


def test_reads_what_twin_run_writes(tmp_path, capsys):
    model = synthetic.machine()
    write_artefact(tmp_path / "a.h5", model, certificate={"step": 60.0}, provenance={"command": "synthetic"})
    time, signals = synthetic.loads(model.load_model, 0.5)
    columns = {s.column: signals[s.name] for s in model.load_model.signals}
    units = {s.column: s.unit for s in model.load_model.signals}
    write_run(tmp_path / "run", Run(Table(time, columns, units), provenance="synthetic", synthetic=("loads",)))
    assert run(["run", str(tmp_path / "a.h5"), str(tmp_path / "run"), "-o", str(tmp_path / "out")]) == 0
    capsys.readouterr()
    assert run(["warmup", str(tmp_path / "out"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert set(told["tcp_actual"]) == {"dx", "dy", "dz"}
    with h5py.File(tmp_path / "out" / "result.h5") as f:
        change = np.abs(f["tcp_actual"][...] - f["tcp_actual"][-1]).max(axis=0)
    found = [told["tcp_actual"][f"d{c}"]["change_m"] for c in "xyz"]
    np.testing.assert_allclose(found, change)
