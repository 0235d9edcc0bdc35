"""`twin run` and `twin info` as a user calls them."""

import csv
import json
import shutil

import h5py
import numpy as np
import pytest
import synthetic
import synthetic_run
from click.testing import CliRunner

from twin.cli.info import command as info
from twin.cli.run import command as run
from twin.errors import ArtefactError, TwinError
from twin.rom.artefact import read_artefact

MODEL = synthetic.machine()


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inputs")
    artefact = synthetic_run.artefact(folder / "a.h5", MODEL)
    return str(artefact), str(synthetic_run.run_folder(folder / "run", MODEL, hours=1.0))


def call(command, *arguments):
    return CliRunner().invoke(command, list(arguments), catch_exceptions=False)


@pytest.fixture(scope="module")
def output(inputs, tmp_path_factory):
    folder = tmp_path_factory.mktemp("out") / "run"
    told = call(run, *inputs, "-o", str(folder))
    assert told.exit_code == 0
    assert "61 steps" in told.output
    return folder


def test_files_of_a_result(output):
    assert sorted(p.name for p in output.iterdir()) == ["result.h5", "summary.json", "tcp.csv", "temperatures.csv"]
    with (output / "tcp.csv").open() as f:
        rows = list(csv.reader(f))
    assert rows[0] == ["time [s]", "x [mm]", "y [mm]", "dx [um]", "dy [um]", "dz [um]"]
    with h5py.File(output / "result.h5") as f:
        np.testing.assert_allclose(np.array(rows[1:], float)[:, 3:], f["tcp_actual"][...] * 1e6, rtol=1e-8)
        assert f["temperature"].attrs["units"] == "degC"
        assert [d[0].name for d in f["tcp"].dims] == ["/time", "/pose", "/component"]
    with (output / "temperatures.csv").open() as f:
        assert next(csv.reader(f))[:3] == ["time [s]", "T00 [degC]", "T01 [degC]"]


def test_summary_adds_up(output):
    told = json.loads((output / "summary.json").read_text())
    heat = told["heat"]
    balance = heat["sources_J"] + heat["environments_in_J"] - heat["environments_out_J"] - heat["stored_J"]
    assert abs(balance) < 1e-9 * heat["sources_J"]
    assert heat["max_balance_error"] <= 1e-8
    with h5py.File(output / "result.h5") as f:
        np.testing.assert_allclose(told["tcp"]["max_abs_m"], np.abs(f["tcp"][...]).max(axis=(0, 1)))
        assert len(told["flags"]) == f["flags"].shape[1]
    assert told["flagged_steps"] == 0


def test_goes_on_from_a_result(inputs, output, tmp_path):
    told = call(run, *inputs, "-o", str(tmp_path / "next"), "--initial", str(output / "result.h5"))
    assert told.exit_code == 0
    with h5py.File(output / "result.h5") as before, h5py.File(tmp_path / "next" / "result.h5") as after:
        np.testing.assert_allclose(after["states"][0], before["states"][-1], rtol=1e-10, atol=1e-10)
    other = synthetic_run.artefact(tmp_path / "other.h5", synthetic.machine(seed=5))
    with pytest.raises(TwinError, match="another artefact"):
        call(run, str(other), inputs[1], "-o", str(tmp_path / "x"), "--initial", str(output / "result.h5"))


def test_resume_of_a_finished_run_and_equal_files(inputs, output, tmp_path):
    told = call(run, *inputs, "-o", str(tmp_path / "again"), "--resume")
    assert told.exit_code == 0
    for name in ("result.h5", "temperatures.csv", "tcp.csv"):
        assert (tmp_path / "again" / name).read_bytes() == (output / name).read_bytes()


def test_flags_are_told(inputs, tmp_path):
    told = call(run, *inputs, "-o", str(tmp_path / "r"), "--dt", "10 s")
    assert "substep shorter than the certified 15 s: 361 steps" in told.output


def test_info_tells_states_poses_and_parameters(inputs):
    told = call(info, inputs[0])
    assert told.exit_code == 0
    for word in ("36 states", "9 poses", "body_1", "films.body_0_natural", "sources.x_nut.gain", "4 .. 16 W/(m^2*K)"):
        assert word in told.output
    facts = json.loads(call(info, inputs[0], "--json").output)
    assert facts["states"] == MODEL.n
    assert facts["model_sha256"] == read_artefact(inputs[0]).digest
    assert facts["certified_ranges"]["signals"]["x_current"] == {
        "low": 0.0,
        "high": 20.0,
        "unit": "A",
        "column": "x_current",
    }
    assert facts["provenance"] == {"command": "synthetic"}


def test_bad_input_is_a_twin_error(inputs, tmp_path):
    (tmp_path / "bad.h5").write_text("nonsense")
    with pytest.raises(ArtefactError):
        call(info, str(tmp_path / "bad.h5"))
    for option, value in (("--dt", "-5 s"), ("--initial", "-400 degC"), ("-o", str(tmp_path / "bad.h5"))):
        with pytest.raises(TwinError) as caught:
            call(run, *inputs, "-o", str(tmp_path / "r"), option, value)
        assert (value if option == "-o" else option) in str(caught.value)
    with pytest.raises(ArtefactError, match="folder"):
        call(info, str(tmp_path))


def test_measured_data_is_never_replaced_by_results(inputs, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(inputs[1], folder)
    (folder / "temperatures.csv").write_text("time [s],T00 [degC]\n0,20\n")
    before = {p.name: p.read_bytes() for p in folder.iterdir()}
    with pytest.raises(TwinError, match="run folder") as caught:
        call(run, inputs[0], str(folder), "-o", str(folder))
    assert "-o" in str(caught.value)
    assert {p.name: p.read_bytes() for p in folder.iterdir()} == before


def test_loads_beyond_all_reason_leave_no_result(inputs, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(inputs[1], folder)
    lines = (folder / "loads.csv").read_text().splitlines()
    column = next(i for i, name in enumerate(lines[0].split(",")) if "current" in name)
    cells = lines[5].split(",")
    cells[column] = "1e300"
    lines[5] = ",".join(cells)
    (folder / "loads.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(TwinError, match=r"current' is 1e\+300 A, once: beyond all reason"):
        call(run, inputs[0], str(folder), "-o", str(tmp_path / "r"))
    assert not (tmp_path / "r" / "result.h5").exists()
