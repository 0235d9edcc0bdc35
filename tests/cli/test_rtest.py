"""`twin rtest` as a user calls it."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.calibrate.test_rtest import CENTRE, CHAIN, growth, hourly, result, run_of
from twin.calibrate.axis_errors.errors import Ranges
from twin.calibrate.axis_errors.htm import measured_displacement
from twin.calibrate.axis_errors.rtest import readings
from twin.calibrate.axis_errors.rtest_plan import rtest_plan
from twin.cli.main import run
from twin.logs.write import write_run


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """R-tests by the indexed plan at 0, 1 and 2 h."""
    path = tmp_path_factory.mktemp("rtest") / "run"
    write_run(path, run_of(hourly(kind="indexed")))
    return path


def told(capsys, *arguments: object) -> str:
    assert run(["rtest", *map(str, arguments)]) == 0
    return capsys.readouterr().out


def refused(capsys, *arguments: object) -> str:
    assert run(["rtest", *map(str, arguments)]) == 2
    err = capsys.readouterr().err
    assert "remedy" in err
    return err


def test_the_table_tells_what_is_determined(folder, capsys):
    out = told(capsys, folder, "--chain", CHAIN)
    assert out.count("15 of 21 determined, rank 15; hidden: EBX, EXY, EZY, EAY, EBY, ECY") == 3
    assert out.count("as the noise allows") == 3
    at_2h = told(capsys, folder, "--chain", CHAIN, "--at", "2 h")
    assert at_2h in out.replace(out[out.index("\n\n1:") : out.index("\n\n3:")], "")
    row = next(line for line in at_2h.splitlines() if line.strip().startswith("EX. [um]"))
    cells = row.split("]")[1].split("+-")
    assert float(cells[0]) == pytest.approx(1e6 * growth(2.0)["EXX"], abs=3.0)
    assert "hidden" in row  # EXY


def test_json_and_files(folder, capsys, tmp_path):
    facts = json.loads(told(capsys, folder, "--chain", CHAIN, "--json", "-o", tmp_path / "out"))
    assert facts == json.loads((tmp_path / "out" / "rtest.json").read_text(encoding="utf-8"))
    assert [m["rows"] for m in facts["measurements"]] == [28, 28, 28]
    rows = list(csv.reader((tmp_path / "out" / "axis_errors.csv").open(encoding="utf-8")))
    assert rows[0][:3] == ["time [s]", "EXX [m]", "EXX_sigma [m]"]
    assert len(rows[0]) == 1 + 2 * 15
    for hour, (row, m) in enumerate(zip(rows[1:], facts["measurements"], strict=True)):
        assert float(row[0]) == m["start_s"] == 3600.0 * hour
        for name, entry in m["determined"].items():
            assert float(row[rows[0].index(f"{name} [{entry['unit']}]")]) == pytest.approx(entry["value"], rel=1e-8)
            assert abs(entry["value"] - growth(hour)[name]) < 4.5 * entry["sigma"]
        assert m["not_determined"] == ["EBX", "EXY", "EZY", "EAY", "EBY", "ECY"]


def test_unknown_balls_and_misfit(capsys, tmp_path):
    write_run(tmp_path / "run", run_of(hourly((1.0,), misplaced=2e-4)))
    out = told(capsys, tmp_path / "run", "--chain", CHAIN)
    assert "MISFIT" in out
    assert "are the places of the balls known?" in out
    out = told(capsys, tmp_path / "run", "--chain", CHAIN, "--balls", "unknown")
    assert "as the noise allows" in out
    assert "14 of 21 determined, rank 16" in out
    assert out.count("seen only together:") == 2
    assert "together" in next(line for line in out.splitlines() if "EX. [um]" in line)


def test_noise_on_the_command_line(capsys, tmp_path):
    tcp = hourly((1.0,))
    write_run(tmp_path / "run", run_of(replace(tcp, sigma=None)))
    assert "MISFIT" in told(capsys, tmp_path / "run", "--chain", CHAIN, "--sigma", "0.3 um")
    assert "noise 2.00 um: as the noise allows" in told(capsys, tmp_path / "run", "--chain", CHAIN, "--sigma", "2 um")
    assert "MISFIT" not in told(capsys, tmp_path / "run", "--chain", CHAIN)


def test_what_the_rows_are_is_said(capsys, tmp_path):
    tcp = hourly((1.0,))
    displacement = np.where(np.arange(len(tcp.time))[:, None] == 4, np.nan, tcp.displacement)
    write_run(tmp_path / "run", replace(run_of(replace(tcp, displacement=displacement)), tcp_reference="first"))
    out = told(capsys, tmp_path / "run", "--chain", CHAIN)
    assert "1 rows of tcp.csv lack a position or a deviation" in out
    assert "count from the first row" in out
    assert "37 rows" in out


def test_model_beside_the_measurement(folder, capsys, tmp_path):
    grid = np.stack(np.meshgrid(*[np.linspace(-0.4, 0.4, 3)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    read = readings(run_of(hourly(kind="indexed")), CHAIN)
    field = measured_displacement(CHAIN, Ranges.of(CHAIN, read.position), growth(1.0), grid[:, [1, 0, 2]])
    time = np.array([0.0, 1.0, 3.0]) * 3600.0
    result(tmp_path / "result.h5", time, time[:, None, None] / 3600.0 * field, grid)
    facts = json.loads(told(capsys, folder, "--chain", CHAIN, "--result", tmp_path, "--json", "--at", "2 h"))
    (m,) = facts["measurements"]
    assert m["number"] == 3
    for name, value in m["model"]["errors"].items():
        entry = m["determined"][name]
        grown = (2.0 + 135.0 / 3600.0) * growth(1.0)[name]  # in the middle of the measurement
        assert value == pytest.approx(grown, abs=2e-8)
        assert abs(value - entry["value"]) < 5.0 * entry["sigma"] + abs(grown - growth(2.0)[name])
    assert m["model"]["volume"]["rest"] < 1e-6
    out = told(capsys, folder, "--chain", CHAIN, "--result", tmp_path, "--at", "2 h")
    shares = m["model"]["volume"]
    assert f"axis errors {100 * shares['axis_errors']:.1f} %, rest 0.0 %" in out
    assert shares["shift"] + shares["tilt"] + shares["axis_errors"] == pytest.approx(1.0, abs=1e-6)
    assert f"({1e6 * m['model']['errors']['EYY']:.1f})" in out


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ((), "which axes carry the tool is not known"),
        (("--chain", "X-Y-Z"), "no kinematic chain"),
        (("--chain", CHAIN, "--at", "9 h"), "measurements are from"),
        (("--chain", CHAIN, "--gap", "0 s"), "out of range"),
        (("--chain", CHAIN, "--gap", "5 s"), "rows in the longest measurement; 10 are needed"),
        (("--chain", "w-C-B'-Z-b-X-Y-t", "--balls", "unknown"), "miss a ball on the table"),
        (("--chain", CHAIN, "--result", "nowhere"), "not a result"),
        (("--artefact", "nowhere.h5"), "nowhere.h5"),
    ],
)
def test_wrong_options_are_refused(options, what, folder, capsys):
    assert what in refused(capsys, folder, *options)


def test_results_do_not_go_into_run_folders(folder, capsys):
    assert "is a run folder" in refused(capsys, folder, "--chain", CHAIN, "-o", folder)


def test_single_probings_are_refused_with_the_number_needed(capsys, tmp_path):
    plan = rtest_plan(CHAIN, centre=CENTRE, interval=3600.0)
    write_run(tmp_path / "run", run_of(plan.tcp(np.zeros((len(plan.time), 3)))))
    assert "1 rows in the longest measurement; 10 are needed" in refused(capsys, tmp_path / "run", "--chain", CHAIN)
