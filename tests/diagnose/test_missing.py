"""A diagnosis names what moves the tool and is no part of the model, and says where a model is too poor."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner

from tests.calibrate.members import planted
from twin.cli.main import cli
from twin.face.diagnose import DiagnoseOptions, diagnose
from twin.face.model import read
from twin.logs.write import write_run
from twin.machine.extend import removed


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    real = planted.machine(folder / "real", planted.hidden())
    made = []
    for seed in range(3):
        write_run(folder / f"run_{seed}", planted.measured(real, seed))
        made.append(folder / f"run_{seed}")
    return made


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("machine")
    planted.machine(folder / "small")
    done = CliRunner().invoke(cli, ["build", str(folder / "small"), "-o", str(folder / "small.h5")])
    assert done.exit_code == 0, done.output
    return folder / "small.h5"


@pytest.mark.slow
def test_the_body_at_the_wall_is_named_and_written(runs, built, tmp_path):
    options = DiagnoseOptions(nulls=20, noise="0.05 K", tcp_noise="0.3 um")
    found = diagnose(read(built), runs[:2], [runs[2]], options=options)
    assert found.verdict == "named"
    assert "signals.wall" in [c.place for c in found.causes]
    assert "signals.door" not in [c.place for c in found.causes]
    gains = {g.channel: g for g in found.findings.gain if g.unit == "m"}
    for axis in ("dy", "dz"):
        assert gains[axis].extended < 0.7 * gains[axis].recalibrated
        assert gains[axis].ci95[0] > 0.0
    report = found.report(tmp_path / "report", build=False)
    text = (report.folder / "machine.toml").read_text(encoding="utf-8")
    assert "follows_wall_20min" in text
    assert "follows_wall" not in removed(text)
    assert "missing members" in (report.folder / "index.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_model_that_misses_by_kelvins_names_nothing(runs, tmp_path):
    """The same loads, other bodies: three sensors at places that the description has at others."""
    text = planted.TEXT + "".join(
        f'\n[sensors.s{k}]\npart = "{part}"\n' for k, part in enumerate(("shaft", "housing", "housing", "shaft"))
    )
    planted.machine(tmp_path / "small", text)
    done = CliRunner().invoke(cli, ["build", str(tmp_path / "small"), "-o", str(tmp_path / "small.h5")])
    assert done.exit_code == 0, done.output
    from dataclasses import replace

    from twin.logs.read import read_run

    folders = []
    for k, folder in enumerate(runs[:2]):
        run = read_run(folder)
        table = run.temperatures
        rise = run.loads.columns["wall"] - run.loads.columns["wall"][0]
        drift = np.interp(table.time, run.loads.time, rise)
        shaft = table.columns["shaft"]
        columns = {"s0": shaft + 0.8 * drift, "s1": 22.0 + drift, "s2": 22.0 - drift, "s3": shaft - 0.7 * drift}
        whole = replace(run, temperatures=replace(table, columns=columns, units=dict.fromkeys(columns, "degC")))
        write_run(tmp_path / f"poor_{k}", replace(whole, folder=tmp_path))
        folders.append(tmp_path / f"poor_{k}")
    found = diagnose(read(tmp_path / "small.h5"), folders, options=DiagnoseOptions(nulls=20, noise="0.05 K"))
    assert found.verdict == "too_poor"
    assert not found.causes
    assert "a body that follows" in str(found)
