"""The DLL of an FMU, loaded and stepped by a Windows program under Wine."""

from __future__ import annotations

import shutil
import subprocess
import sys
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import twin
from twin.logs.read import read_run
from twin.rom.artefact import read_artefact
from twin.run.replay import replay

fmpy = pytest.importorskip("fmpy")

from tests.reference.exports.run_fmu_fmpy import inputs, loads  # noqa: E402

RUN = Path(__file__).parents[1] / "machines" / "spindle" / "runs" / "warm_up"
SAME, SAME_PLACE = 1e-9, 1e-15  # K, m
MINGW = shutil.which("x86_64-w64-mingw32-gcc")
COMPILER = (MINGW,) if MINGW else (sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-windows-gnu")

pytestmark = [
    pytest.mark.skipif(shutil.which("wine") is None, reason="no wine"),
    pytest.mark.skipif(MINGW is None and find_spec("ziglang") is None, reason="no compiler for Windows"),
    pytest.mark.long,
]


def test_a_program_for_windows_gets_what_twin_run_gives(lumped, tmp_path, monkeypatch):
    monkeypatch.setenv("WINEPREFIX", str(tmp_path / "wine"))
    monkeypatch.setenv("WINEDEBUG", "-all")
    twin.export(lumped, "fmu2", tmp_path / "a.fmu")
    expected, initial = replay(read_artefact(lumped), read_run(RUN)), read_run(RUN).initial_temperature
    description = fmpy.read_model_description(str(tmp_path / "a.fmu"))
    folder = fmpy.extract(str(tmp_path / "a.fmu"), unzipdir=str(tmp_path / "unzipped"))
    (dll,) = Path(folder).glob("binaries/win64/*.dll")
    reference = {v.name: v.valueReference for v in description.modelVariables}
    outputs = [f"T_{name}" for name in expected.sensors] + [f"tcp_{c}" for c in "xyz"]

    columns = loads(RUN)
    table = inputs(columns, [n for n in reference if n in columns or n.removesuffix("_rate") in columns])
    commands = [f"s {reference['T_initial']} {initial!r}"]
    edges = np.union1d(table["time"][:-1], np.arange(0.0, expected.time[-1] - expected.time[0] + 1.0, 60.0))
    for k, (begin, end) in enumerate(pairwise(edges)):
        row = table[np.searchsorted(table["time"], begin, side="right") - 1]
        own = [n for n in table.dtype.names[1:] if np.isfinite(row[n])]
        straight = {n.removesuffix("_rate") for n in own if n.endswith("_rate")}
        for n in own:
            moved = row[f"{n}_rate"] * (begin - row["time"]) if n in straight else 0.0
            commands.append(f"s {reference[n]} {float(row[n] + moved)!r}")
        commands += ["b"] if k == 0 else []
        commands.append(f"d {float(begin)!r} {float(end - begin)!r}")
        if end % 60.0 == 0.0:
            commands += [f"g {reference[n]}" for n in outputs]

    program = tmp_path / "windows_master.exe"
    source = Path(__file__).with_name("windows_master.c")
    subprocess.run([*COMPILER, "-O2", "-o", str(program), str(source)], check=True)
    done = subprocess.run(["wine", str(program), str(dll), description.guid], input="\n".join(commands).encode(),
                          capture_output=True, check=False, timeout=300)  # fmt: skip
    assert done.returncode == 0, done.stderr.decode(errors="replace")[-2000:]
    found = np.array(done.stdout.split(), dtype=float).reshape(-1, len(outputs))
    assert np.ptp(found[:, : len(expected.sensors)]) > 1.0
    assert np.abs(found[:, : len(expected.sensors)] - expected.temperature[1:]).max() < SAME
    assert np.abs(found[:, len(expected.sensors) :] - expected.tcp_actual[1:]).max() < SAME_PLACE
