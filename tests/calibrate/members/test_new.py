"""From a log of unknown columns to a machine that predicts: columns, damage, network, page."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner

from tests.calibrate.members import planted
from twin.calibrate.propose.columns import read_log
from twin.cli.main import cli
from twin.errors import LogError
from twin.face.new import from_log
from twin.logs.read import read_run
from twin.run.replay import replay


def write_log(path, run, decimals=2, **changed):
    """A CSV as a logger writes it: no units, minutes, the names of the sensors."""
    columns = {"Time": run.loads.time / 60.0}
    columns |= {f"TC{k}": run.loads.columns[name] for k, name in enumerate(("air", "wall", "door"), 1)}
    shaft = run.temperatures.columns["shaft"]
    columns["PT01"] = np.interp(run.loads.time, run.temperatures.time, shaft)
    columns["Spindle speed"] = 60.0 * run.loads.columns["speed"]
    for name, axis in (("Disp. Y", 1), ("Disp. Z", 2)):
        columns[name] = 1e6 * np.interp(run.loads.time, run.tcp.time, run.tcp.displacement[:, axis])
    columns |= changed
    rows = np.column_stack(list(columns.values()))
    lines = [",".join(columns), *(",".join(f"{v:.{decimals}f}" for v in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    real = planted.machine(folder / "real", planted.hidden())
    return [write_log(folder / f"day_{seed}.csv", planted.measured(real, seed)) for seed in range(6)]


@pytest.mark.slow
def test_network_beats_the_regression_and_runs(logs, tmp_path):
    out = tmp_path / "found"
    arguments = ["new", str(out), *(f"--from-log={p}" for p in logs[:4]), *(f"--sealed={p}" for p in logs[4:])]
    done = CliRunner().invoke(cli, arguments, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert "guessed" in done.output
    assert "Disp. Z" in (out / "index.html").read_text(encoding="utf-8")
    again = from_log(logs[:4], tmp_path / "again", logs[4:])
    for figure in again.figures:
        if figure.part == "sealed":
            assert figure.network < 0.25 * figure.zero
            assert figure.network < figure.ridge
    # what is written predicts what was said: the runtime's step instead of the exact lag
    artefact = planted.artefact(tmp_path / "built", (out / "machine.toml").read_text(encoding="utf-8"))
    run = read_run(out / "runs" / "day_5")
    result = replay(artefact, run, 60.0)
    for p in (p for p in again.predicted if p.run == "day_5" and p.part == "sealed"):
        w = result.tcp_actual[:, "xyz".index(p.axis[1])]
        np.testing.assert_allclose(np.interp(p.time, result.time, w - w[0]), p.network, atol=0.02 * np.ptp(p.network))


@pytest.mark.long
def test_a_broken_sensor_and_a_splice_are_told(logs, tmp_path):
    lines = logs[0].read_text(encoding="utf-8").splitlines()
    other = logs[1].read_text(encoding="utf-8").splitlines()
    spliced = tmp_path / "spliced.csv"
    cells = [line.split(",") for line in other[1:]]
    tail = [[line.split(",")[0], *(f"{float(c) + 6.0:.2f}" for c in cells[k][1:5]), *cells[k][5:]]
            for k, line in enumerate(lines[500:], 499)]  # fmt: skip
    spliced.write_text("\n".join([*lines[:500], *map(",".join, tail)]) + "\n", encoding="utf-8")
    made = from_log([spliced, *logs[2:4]], tmp_path / "out")
    assert any("rows of another time" in line and "501" in line for line in made.not_used)
    assert read_run(tmp_path / "out" / "runs" / "spliced").loads.time[-1] < 500.5 * 60.0


def test_columns_are_guessed_and_told(tmp_path):
    path = tmp_path / "log.csv"
    rows = [f"{0.5 * k},{20 + 0.01 * k:.2f},{k % 7},{0.1 * k:.2f},{3000 * (k % 2)}" for k in range(240)]
    path.write_text("\n".join(["t,bed,counter,probe X,spindle speed", *rows]), encoding="utf-8")
    run, columns = read_log(path)
    by_name = {c.name: c for c in columns}
    assert by_name["t"].unit == "min"
    assert (by_name["bed"].role, by_name["bed"].unit) == ("temperature", "degC")
    assert by_name["counter"].role == "left out"
    assert (by_name["probe X"].role, by_name["spindle speed"].unit) == ("dx", "1/min")
    assert run.tcp.displacement[10, 0] == pytest.approx(1e-6)
    assert np.isnan(run.tcp.displacement[:, 1:]).all()
    again, _ = read_log(path, {"probe X": "mm", "t": "s"}, {"dz": "probe X"})
    assert again.tcp.displacement[10, 2] == pytest.approx(1e-3)
    assert again.loads.time[-1] == pytest.approx(119.5)


@pytest.mark.parametrize(
    ("text", "arguments", "said"),
    [
        ("", [], "no table"),
        ("t,a\n0,1\n1,2\n2,3\n", [], "unit of 't' is not told"),
        ("t [s],a [degC]\n0,20\n60,21\n120,22\n", [], "no displacements"),
        ("t [s],a [degC]\n0,20\n60,21\n120,22\n", ["--unit", "b=degC"], "no column 'b'"),
        ("t [s],a [degC]\n0,20\n60,21\n120,22\n", ["--unit", "a"], "has no value"),
        ("t [s],a [degC]\n0,20\n60,21\n120,22\n", ["--axis", "dq=a"], "no axis 'dq'"),
        ("t [s],a [degC],d [um]\n0,20,0\n60,21,1\n30,22,2\n", [], "times do not increase"),
        ("t [s],a [degC],a [degC]\n0,20,0\n60,21,1\n90,22,2\n", [], "appears twice"),
        ("t [s],d [um]\n0,0\n60,1\n90,2\n", [], "no temperatures"),
        ("t [s],a [flurb],d [um]\n0,2,0\n60,3,1\n90,4,2\n", [], "flurb"),
    ],
)
def test_what_cannot_be_understood_is_one_error(text, arguments, said, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(Exception) as caught:
        CliRunner().invoke(
            cli, ["new", str(tmp_path / "o"), "--from-log", str(path), *arguments], catch_exceptions=False
        )
    assert said in str(caught.value)
    assert not (tmp_path / "o").exists()


def test_nothing_is_overwritten(tmp_path):
    (tmp_path / "o").mkdir()
    (tmp_path / "o" / "mine.txt").write_text("x", encoding="utf-8")
    with pytest.raises(LogError, match="is there already"):
        from_log([tmp_path / "log.csv"], tmp_path / "o")
    assert [p.name for p in (tmp_path / "o").iterdir()] == ["mine.txt"]
