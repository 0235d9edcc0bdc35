"""`twin update` as a command."""

import dataclasses
import json
from pathlib import Path

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

from twin.cli.update import command
from twin.errors import TwinError
from twin.logs.read import read_run
from twin.logs.run import Table, Tcp
from twin.logs.write import write_run
from twin.rom.artefact import read_artefact
from twin.run.replay import replay

RUN = "tests/machines/slide/runs/short"


@pytest.fixture(scope="module")
def measured(slide_artefact, tmp_path_factory):
    """The short run, with rows of tcp.csv some micrometres beside the model and one far off."""
    folder = tmp_path_factory.mktemp("measured") / "run"
    run = read_run(Path(RUN))
    result = replay(read_artefact(slide_artefact), run)
    rows = np.arange(5, 31, 5)
    displacement = 1.2 * result.tcp[rows, 2] + np.array([1e-6, 0.0, -2e-6])
    displacement[4, 1] += 80e-6
    tcp = Tcp(result.time[rows], ("x",), np.tile(result.poses[2], (len(rows), 1)), displacement)
    write_run(folder, dataclasses.replace(run, tcp=tcp, synthetic=("loads", "tcp")))
    return folder


def invoke(*arguments):
    return CliRunner().invoke(command, [str(a) for a in arguments])


@pytest.mark.long
@pytest.mark.parametrize("method", ["gain", "paper", "state"])
def test_writes_what_it_found(slide_artefact, measured, tmp_path, method):
    done = invoke(slide_artefact, measured, "--method", method, "--json", "-o", tmp_path / "u")
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert told == json.loads((tmp_path / "u" / "summary.json").read_text(encoding="utf-8"))
    assert told["used"] == told["rows"] == 6
    with h5py.File(tmp_path / "u" / "update.h5") as f:
        np.testing.assert_allclose(f["base"][...] + 0.0, f["base"][...])
        assert f["correction"].shape == f["base"].shape == (31, 5, 3)
        assert f["correction"].attrs["units"] == "m"
        assert np.abs(f["correction"][...]).max() > 0.5e-6
    assert (tmp_path / "u" / ("state.h5" if method == "state" else "state.json")).exists()
    if method != "paper":
        assert [g["axis"] for g in told["rejected_tcp"]] == ["dy"]


def test_the_summary_compares_with_hold_last(slide_artefact, measured):
    done = invoke(slide_artefact, measured, "--method", "gain", "--interval", "10 min")
    assert done.exit_code == 0, done.output
    assert "3 of 6 TCP measurements used" in done.output
    assert "hold last" in done.output
    assert "before it was used" in done.output


def test_what_is_not_used_is_named(slide_artefact, measured, tmp_path):
    run = read_run(measured)
    hot = Table(np.array([60.0, 120.0]), {"coolant_tank": np.array([31.0, 31.5])}, {"coolant_tank": "degC"})
    late = dataclasses.replace(run.tcp, time=np.append(run.tcp.time[:-1], 99_999.0))
    write_run(tmp_path / "run", dataclasses.replace(run, temperatures=hot, tcp=late))
    done = invoke(slide_artefact, tmp_path / "run", "--method", "gain")
    assert done.exit_code == 0, done.output
    assert "not sensors of the machine: coolant_tank" in done.output
    assert "1 rows of tcp.csv left out" in done.output


@pytest.mark.parametrize(
    ("options", "what"),
    [
        (["--interval", "1 h", "--tolerance", "2 um"], "one of --interval and --tolerance"),
        (["--method", "paper", "--tolerance", "2 um"], "predicts no uncertainty"),
        (["--method", "gain", "--earlier", RUN], "nothing to learn"),
        (["--interval", "-3 min"], "out of range"),
        (["--noise", "2 bananas"], "--noise"),
        (["-o", RUN], "run folder"),
    ],
)
def test_bad_options_are_told(slide_artefact, measured, options, what):
    done = invoke(slide_artefact, measured, *options)
    assert isinstance(done.exception, TwinError)
    assert what in str(done.exception)


def test_a_run_without_tcp_is_refused(slide_artefact):
    done = invoke(slide_artefact, RUN, "--method", "gain")
    assert isinstance(done.exception, TwinError)
    assert "no tcp.csv" in str(done.exception)
