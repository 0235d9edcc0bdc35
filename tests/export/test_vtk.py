"""Series for ParaView: VTK reads them back exactly; volumes are the full model's."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.spatial import KDTree

import twin
from tests.reference.exports import read_vtk
from twin.errors import TwinError
from twin.export.frames import frames_of
from twin.export.options import ExportOptions
from twin.logs.read import read_run
from twin.machine.load import load_machine
from twin.rom.artefact import read_artefact, write_artefact
from twin.run.replay import replay
from twin.run.results import write_results

pytest.importorskip("vtkmodules", reason="VTK is not installed (extra `compare`)")
ROOT = Path(__file__).parents[2]
SHORT = ROOT / "tests" / "machines" / "slide" / "runs" / "short"


def written(artefact, folder: Path, options: ExportOptions) -> tuple[list, list]:
    twin.export(artefact, "vtk", folder / "series", options)
    twin.export(artefact, "vtkhdf", folder / "s.vtkhdf", options)
    by_file = list(read_vtk.frames_of_pvd(folder / "series" / "series.pvd"))
    return by_file, list(read_vtk.frames_of_vtkhdf(folder / "s.vtkhdf"))


def test_the_surface_comes_back_exactly(slide_artefact, slide_result, tmp_path):
    options = ExportOptions(result=slide_result, frames=5)
    artefact = read_artefact(slide_artefact)
    made = frames_of(artefact, options)
    wanted = list(made.frames)
    assert len(wanted) == made.count == 5
    for read in written(slide_artefact, tmp_path, options):
        assert len(read) == 5
        for frame, (time, grid) in zip(wanted, read, strict=True):
            points, data = read_vtk.arrays(grid)
            assert time == frame.time
            np.testing.assert_array_equal(points, frame.points)
            for name in ("temperature", "displacement"):
                np.testing.assert_array_equal(data[name], frame.data[name])
            assert grid.GetNumberOfCells() == len(made.cells)
    # and the frames are those of the result: the hottest vertex is as hot as the hottest sensor, or hotter
    with h5py.File(slide_result / "result.h5") as f:
        hottest, position = f["temperature"][-1].max(), f["position"][-1, 0]
    assert hottest - 0.5 < wanted[-1].data["temperature"].max() < hottest + 20.0
    slide = artefact.fields[1]
    moved = wanted[-1].points[len(artefact.fields[0].nodes) :] - slide.nodes
    np.testing.assert_allclose(moved, np.tile([position, 0.0, 0.0], (len(moved), 1)), atol=1e-12)


@pytest.mark.long
def test_the_volume_is_the_full_models(slide_artefact, tmp_path):
    artefact = read_artefact(slide_artefact)
    result = replay(artefact, read_run(SHORT))
    write_results(tmp_path / "out", result, {"run": str(SHORT)})
    options = ExportOptions(result=tmp_path / "out", frames=3, field=True)
    by_file, by_hdf = written(slide_artefact, tmp_path, options)
    truth = twin.simulate(ROOT / "tests" / "machines" / "slide", SHORT)
    machine = load_machine(ROOT / "tests" / "machines" / "slide")
    assert truth.temperatures is not None
    for (time, grid), (again, other) in zip(by_file, by_hdf, strict=True):
        points, data = read_vtk.arrays(grid)
        also, others = read_vtk.arrays(other)
        assert time == again
        np.testing.assert_array_equal(points, also)
        for name in ("temperature", "displacement"):
            np.testing.assert_array_equal(data[name], others[name])
    # a sensor is the full model's temperature at its place
    name, sensor = next(iter(machine.sensors.items()))
    nearest = np.linalg.norm(points - np.array(sensor.position), axis=1).argmin()  # of a part that does not move
    assert data["temperature"][nearest] == pytest.approx(truth.temperatures.columns[name][-1], abs=0.3)
    assert 1e-6 < np.abs(data["displacement"]).max() < 1e-3
    assert np.abs(read_vtk.arrays(by_file[0][1])[1]["displacement"]).max() < np.abs(data["displacement"]).max()
    # the surface of the reduced model is where the full model's vertices are: those at the same place, of either part
    frames = list(frames_of(artefact, ExportOptions(result=tmp_path / "out", frames=3)).frames)
    for frame, (_, grid) in zip(frames[1:], by_file[1:], strict=True):
        points, data = read_vtk.arrays(grid)
        true, u = data["displacement"], frame.data["displacement"]
        there = KDTree(points).query_ball_point(frame.points, 1e-9)
        off = np.array([np.linalg.norm(true[k] - own, axis=1).min() for k, own in zip(there, u, strict=True)])
        assert np.sqrt(np.mean(off**2)) < 0.01 * np.sqrt(np.mean(np.sum(u**2, axis=1)))


def test_a_surface_without_displacements_says_so(slide_artefact, slide_result, tmp_path):
    artefact = read_artefact(slide_artefact)
    bare = [replace(field, displacement=None, flexibility=None) for field in artefact.fields]
    write_artefact(tmp_path / "a.h5", artefact.model, artefact.description, fields=bare)
    (told,) = twin.export(tmp_path / "a.h5", "vtk", tmp_path / "s", ExportOptions(result=slide_result, frames=2))
    assert "no displacement: the artefact is of an older version or has calibrated expansions" in told
    assert "no displacement" in (tmp_path / "s" / "series.pvd").read_text()
    assert set(next(frames_of(read_artefact(tmp_path / "a.h5"), ExportOptions(result=slide_result)).frames).data) == {
        "temperature"
    }


@pytest.mark.long
def test_pyvista_draws_it(slide_artefact, slide_result, tmp_path):
    pytest.importorskip("pyvista", reason="PyVista is not installed (extra `compare`)")
    twin.export(slide_artefact, "vtk", tmp_path / "s", ExportOptions(result=slide_result, frames=2))
    call = [sys.executable, read_vtk.__file__, tmp_path / "s" / "series.pvd", tmp_path / "p.png"]
    done = subprocess.run([str(c) for c in call], capture_output=True, text=True, timeout=120, check=False)
    if done.returncode < 0:
        pytest.skip("VTK cannot draw without a display here")
    assert done.returncode == 0, done.stderr
    from matplotlib.image import imread

    image = imread(tmp_path / "p.png")[..., :3]
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 100  # a coloured machine, not an empty window


def test_what_cannot_be_drawn_is_refused(slide_artefact, slide_result, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(TwinError, match=r"notes\.txt"):
        twin.export(slide_artefact, "vtk", tmp_path, ExportOptions(result=slide_result))
    with pytest.raises(TwinError, match="of a result"):
        twin.export(slide_artefact, "vtk", tmp_path / "s")
    assert json.dumps([p.name for p in tmp_path.iterdir()]) == '["notes.txt"]'
