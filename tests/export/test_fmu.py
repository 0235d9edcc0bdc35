"""FMUs in the hands of others: FMPy, the FMU Manipulation Toolbox, libcosim."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

import twin
from twin.logs.read import read_run
from twin.rom.artefact import read_artefact
from twin.run.replay import replay

fmpy = pytest.importorskip("fmpy")

from fmpy.fmi2 import FMU2Slave  # noqa: E402
from fmpy.fmi3 import FMU3Slave  # noqa: E402
from fmpy.validation import validate_fmu  # noqa: E402

from tests.reference.exports.run_fmu_fmpy import inputs, loads, simulate  # noqa: E402

ROOT = Path(__file__).parents[2]
SLIDE = ROOT / "tests" / "machines" / "slide" / "runs" / "short"
SPINDLE = ROOT / "tests" / "machines" / "spindle"
SAME, SAME_PLACE = 1e-9, 1e-15  # K, m
SHIPPED = {"five_axis": "experiment_a", "ram_borer": "test_5", "transfer_unit": "working_day",
           "ball_screw_axis": "mixed_load", "spindle_drift": "warm_up", "lathe": "warm_up",
           "linear_gantry": "constant_room", "hexapod": "mixed_paths"}  # fmt: skip

pytestmark = [pytest.mark.long, pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc")]


@pytest.fixture(scope="module", params=["fmu2", "fmu3"])
def fmu(request, slide_artefact, tmp_path_factory):
    path = tmp_path_factory.mktemp("fmu") / f"slide.{request.param}.fmu"
    twin.export(slide_artefact, request.param, path, twin.ExportOptions(poses=True))
    return path


@pytest.fixture(scope="module")
def expected(slide_artefact):
    return replay(read_artefact(slide_artefact), read_run(SLIDE))


@pytest.mark.parametrize("version", ["fmu2", "fmu3"])
def test_a_lumped_machine_is_valid_and_gives_what_twin_run_gives(lumped, version, tmp_path):
    fmu, run = tmp_path / f"spindle.{version}.fmu", SPINDLE / "runs" / "warm_up"
    twin.export(lumped, version, fmu)
    assert validate_fmu(str(fmu)) == []
    agrees(simulate(fmu, run, read_run(run).initial_temperature), replay(read_artefact(lumped), read_run(run)))


def is_second(fmu):
    return "fmu2" in fmu.name


def outputs(result, prefix):
    return np.stack([result[n] for n in result.dtype.names if re.fullmatch(prefix, n)], axis=1)


def agrees(result, expected):
    T = np.stack([result[f"T_{name}"] for name in expected.sensors], axis=1)
    w = np.stack([result[f"tcp_{c}"] for c in "xyz"], axis=1)
    assert np.abs(T[1:] - expected.temperature[1:]).max() < SAME  # at the start air sensors have no value yet
    straight = (
        np.abs(expected.angle).max(axis=1, initial=0.0) == 0.0
    )  # an FMU has the displacement of rotary axes at zero
    assert np.abs(w - expected.tcp_actual)[straight].max() < SAME_PLACE


def test_fmpy_finds_no_problem(fmu):
    assert validate_fmu(str(fmu)) == []


def test_the_toolbox_finds_no_problem(fmu):
    tool = Path(sys.executable).with_name("fmutool")
    if not tool.exists():
        pytest.skip("no fmu-manipulation-toolbox")
    done = subprocess.run([str(tool), "-input", str(fmu), "-check"], capture_output=True, text=True, check=True)
    told = done.stdout + done.stderr
    assert "seems to be compliant" in told
    assert "No semantic error" in told
    assert not re.search(r"\b(ERROR|WARNING)\b", told)


@pytest.mark.parametrize("step", [60.0, 20.0])
def test_fmpy_over_a_run_gives_what_twin_run_gives(fmu, expected, step):
    initial = read_run(SLIDE).initial_temperature
    result = simulate(fmu, SLIDE, initial, step)
    at_steps = result[:: round(60.0 / step)]
    agrees(at_steps, expected)
    poses = outputs(at_steps, r"tcp_p\d+_[xyz]").reshape(expected.tcp.shape)
    assert np.abs(poses - expected.tcp).max() < SAME_PLACE
    assert ((at_steps["flags"][1:] > 0) == expected.flags.any(axis=1)).all()


def test_libcosim_over_a_run_gives_what_twin_run_gives(fmu, expected):
    pytest.importorskip("libcosimpy")
    if not is_second(fmu):
        pytest.skip("libcosim reads FMI 2.0")
    from tests.reference.exports.run_fmu_libcosim import simulate as by_libcosim

    result = by_libcosim(fmu, SLIDE, read_run(SLIDE).initial_temperature)
    for k, time in enumerate(expected.time[1:-1]):
        (row,) = np.flatnonzero(np.isclose(result["time"], time - expected.time[0]))
        for s, name in enumerate(expected.sensors):
            assert abs(result[f"T_{name}"][row] - expected.temperature[k + 1, s]) < SAME


def slave_of(fmu, folder):
    description = fmpy.read_model_description(str(fmu))
    unzipped = fmpy.extract(str(fmu), unzipdir=str(folder))
    kind = FMU2Slave if is_second(fmu) else FMU3Slave
    slave = kind(guid=description.guid, unzipDirectory=unzipped, instanceName="a",
                 modelIdentifier=description.coSimulation.modelIdentifier)  # fmt: skip
    slave.instantiate()
    if is_second(fmu):
        slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    return slave, {v.name: v.valueReference for v in description.modelVariables}


def test_a_state_is_saved_restored_and_stored_as_bytes(fmu, tmp_path):
    slave, reference = slave_of(fmu, tmp_path)
    columns = loads(SLIDE)
    known = [n for n in reference if n != "time"]  # of FMI 3 the independent variable is listed
    table = inputs(columns, [n for n in known if n in columns or n.removesuffix("_rate") in columns])
    names = table.dtype.names[1:]
    get, put = (slave.getReal, slave.setReal) if is_second(fmu) else (slave.getFloat64, slave.setFloat64)
    watched = [reference[n] for n in reference if n.startswith(("T_", "tcp_"))]

    def go(begin, end):
        for k in range(begin, end):
            put([reference[n] for n in names], [float(table[k][n]) for n in names])
            size = table["time"][k + 1] - table["time"][k]
            slave.doStep(currentCommunicationPoint=table["time"][k], communicationStepSize=size)
        return np.array(get(watched))

    save, load, free = slave.getFMUState, slave.setFMUState, slave.freeFMUState
    middle, last = len(table) // 2, len(table) - 1
    at_middle = go(0, middle)
    state = save()
    stored = slave.serializeFMUState(state)
    once = go(middle, last)
    assert np.abs(once - at_middle).max() > 0.0
    load(state)
    assert (np.array(get(watched)) == at_middle).all()
    assert (go(middle, last) == once).all()
    again = slave.deserializeFMUState(stored)
    load(again)
    assert (go(middle, last) == once).all()
    for kept in (state, again):
        free(kept)
    with pytest.raises(Exception, match=r"status 3|Error|error"):
        slave.deserializeFMUState(b"x" * len(stored))
    slave.terminate()
    slave.freeInstance()


def test_gains_change_the_heat_and_reset_takes_it_back(fmu, expected):
    initial = read_run(SLIDE).initial_temperature
    description = fmpy.read_model_description(str(fmu))
    gains = [v.name for v in description.modelVariables if v.name.startswith("gain_source_")]
    assert gains
    columns = loads(SLIDE)
    known = [v.name for v in description.modelVariables if v.causality == "input"]
    table = inputs(columns, [n for n in known if n in columns or n.removesuffix("_rate") in columns])
    hot = fmpy.simulate_fmu(str(fmu), stop_time=expected.time[-1] - expected.time[0], output_interval=60.0, input=table,
                            start_values={"T_initial": initial} | dict.fromkeys(gains, 2.0))  # fmt: skip
    T = np.stack([hot[f"T_{name}"] for name in expected.sensors], axis=1)
    rise = expected.temperature[-1] - expected.temperature[0]
    hottest = int(np.argmax(rise))  # nearly linear in the heat: films change little
    assert T[-1, hottest] - expected.temperature[-1, hottest] == pytest.approx(rise[hottest], rel=0.1)


def test_names_suit_every_tool(fmu):
    variables = fmpy.read_model_description(str(fmu)).modelVariables
    names = [v.name for v in variables]
    assert all(re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", n) for n in names)
    assert len({n.lower() for n in names}) == len(names)
    assert ("independent" in {v.causality for v in variables}) == (not is_second(fmu))


def test_every_function_of_the_standard_is_exported(fmu, tmp_path):
    version = "2" if is_second(fmu) else "3"
    header = Path(fmpy.__file__).parent / "c-code" / f"fmi{version}Functions.h"
    wanted = set(
        re.findall(rf"^\s*FMI{version}_Export fmi{version}\w+TYPE\s+(fmi{version}\w+);", header.read_text(), re.M)
    )
    exchange = re.compile(
        r"fmi2(EnterEvent|NewDiscrete|EnterContinuous|CompletedInt|SetTime|SetCont|GetDer|GetEvent|GetCont|GetNom)"
    )
    wanted = {w for w in wanted if not exchange.match(w)}
    assert len(wanted) > 30
    with zipfile.ZipFile(fmu) as archive:
        files = {n: archive.read(n) for n in archive.namelist() if n.startswith("binaries/")}
    (library,) = (n for n in files if n.endswith(".so"))
    (tmp_path / "a.so").write_bytes(files[library])
    told = subprocess.run(
        ["nm", "-D", "--defined-only", str(tmp_path / "a.so")], capture_output=True, text=True, check=True
    )
    assert wanted == {line.split()[-1] for line in told.stdout.splitlines() if f"fmi{version}" in line}
    for name, content in files.items():  # the Windows library, where one was compiled, names the same
        if name.endswith(".dll"):
            assert content[:2] == b"MZ"
            assert not {w for w in wanted if w.encode() not in content}


def test_equal_input_gives_equal_bytes(slide_artefact, tmp_path):
    for name in ("a", "b"):
        twin.export(slide_artefact, "fmu3", tmp_path / f"{name}.fmu")
    with zipfile.ZipFile(tmp_path / "a.fmu") as a, zipfile.ZipFile(tmp_path / "b.fmu") as b:
        same = [n for n in a.namelist() if a.read(n) == b.read(n)]
        assert set(same) >= {n for n in b.namelist() if not n.endswith(".dll")}  # a linker may write the time there


@pytest.mark.slow
@pytest.mark.parametrize("version", ["fmu2", "fmu3"])
@pytest.mark.parametrize("machine", SHIPPED)
def test_shipped_machines_over_their_scenarios(machine, version, tmp_path):
    folder = ROOT / "models" / machine
    run = folder / "runs" / SHIPPED[machine]
    artefact = tmp_path / "a.h5"
    twin.build(folder, options=twin.BuildOptions(held_out=1)).save(artefact)
    twin.export(artefact, version, tmp_path / "a.fmu")
    assert validate_fmu(str(tmp_path / "a.fmu")) == []
    expected = replay(read_artefact(artefact), read_run(run))
    initial = read_run(run).initial_temperature
    agrees(simulate(tmp_path / "a.fmu", run, expected.temperature[0, -1] if initial is None else initial), expected)
