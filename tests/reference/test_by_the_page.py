"""docs/artefact.md suffices to step an artefact: a script written by it gives what the runtime gives."""

from __future__ import annotations

import io
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import twin
from tests.reference.by_the_page import sensors_over
from tests.support.lumped import climbing
from twin.logs.read import read_run
from twin.rom.artefact import read_artefact
from twin.run.replay import replay

ROOT = Path(__file__).parents[2]
SCRIPT = Path(__file__).parent / "exports" / "step_log.m"
OCTAVE = shutil.which("octave-cli") or shutil.which("octave")
SAME = 1e-9  # K, after the last step as after the first: nothing but rounding


def by_octave(path: Path, folder: Path) -> np.ndarray:
    """The same as `sensors_over` by `step_log.m`, from what `twin export --format mat` writes."""
    mat = path.with_suffix(".mat")
    twin.export(path, "mat", mat)
    initial = repr(read_run(folder).initial_temperature)
    command = [str(OCTAVE), "--norc", "--quiet", str(SCRIPT), str(mat), str(folder / "loads.csv"), initial, "60"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.stdout, done.stderr[-500:]
    return np.loadtxt(io.StringIO(done.stdout), delimiter=",")


@pytest.fixture(params=["numpy", pytest.param("octave", marks=pytest.mark.skipif(OCTAVE is None, reason="no octave"))])
def apart(request):
    """The largest difference of any sensor at any time [K] between a script and the runtime."""

    def difference(path: Path, folder: Path) -> float:
        artefact = read_artefact(path)
        by_runtime = replay(artefact, read_run(folder)).temperature[:, : len(artefact.model.sensors)]
        assert np.ptp(by_runtime) > 5.0
        by_script = (sensors_over if request.param == "numpy" else by_octave)(path, folder)
        assert by_script.shape == by_runtime.shape
        return float(np.abs(by_script - by_runtime).max())

    return difference


def test_a_meshed_machine(slide_artefact, tmp_path, apart):
    shutil.copy(slide_artefact, tmp_path / "a.h5")
    assert apart(tmp_path / "a.h5", ROOT / "tests" / "machines" / "slide" / "runs" / "short") < SAME


def test_a_lumped_machine(tmp_path, apart):
    folder = ROOT / "tests" / "machines" / "spindle"
    twin.build(folder, options=twin.BuildOptions(held_out=4)).save(tmp_path / "a.h5")
    assert apart(tmp_path / "a.h5", folder / "runs" / "warm_up") < SAME


@pytest.mark.long
def test_a_machine_that_climbs_in_air_that_is_warmer_above(tmp_path, apart):
    climbing(tmp_path)
    twin.build(tmp_path, options=twin.BuildOptions(held_out=1)).save(tmp_path / "a.h5")
    assert apart(tmp_path / "a.h5", ROOT / "tests" / "machines" / "spindle" / "runs" / "warm_up") < SAME


@pytest.fixture(
    scope="module",
    params=["ball_screw_axis/mixed_load", pytest.param("five_axis/experiment_a", marks=pytest.mark.slow)],
)
def shipped(request, tmp_path_factory):
    """An artefact and a run: of the axis all that its eight hours hold, in two."""
    machine, name = request.param.split("/")
    folder, path = ROOT / "models" / machine, tmp_path_factory.mktemp(machine) / "a.h5"
    twin.build(folder, options=twin.BuildOptions(held_out=1)).save(path)
    run = folder / "runs" / name
    return path, run if machine == "five_axis" else in_a_quarter(run, path.parent / name)


def in_a_quarter(run: Path, folder: Path) -> Path:
    """Every fourth row of the loads, at a quarter of its time."""
    folder.mkdir()
    shutil.copy(run / "run.toml", folder)
    head, *rows = (run / "loads.csv").read_text(encoding="utf-8").splitlines()
    told = [row.split(",", 1) for row in rows[::4]]
    lines = [head, *(f"{float(time) / 4.0:g},{rest}" for time, rest in told)]
    (folder / "loads.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder


@pytest.mark.slow
def test_a_shipped_machine_over_hours(shipped, apart):
    assert apart(*shipped) < SAME
