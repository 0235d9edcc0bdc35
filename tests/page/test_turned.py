"""Pictures of a machine whose rotary axes stand off zero: the page and series for ParaView."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import twin
from tests.build.test_turning import described, meshed_as_turned
from twin.build.mesh import load_body_meshes
from twin.build.rich_basis import RichOptions
from twin.export.frames import frames_of
from twin.export.options import ExportOptions
from twin.logs.read import read_run
from twin.page.finished import finished_told
from twin.page.front import write_page
from twin.pictures.placed import placed_surface
from twin.pictures.result import read_result
from twin.rom.artefact import read_artefact
from twin.rom.turned_surface import surface_turns, turned_surface
from twin.run.replay import replay
from twin.run.results import write_results

pytestmark = pytest.mark.long  # its machine takes half a minute
RUN = Path(__file__).parents[1] / "machines" / "slide" / "runs" / "short"
ANGLES = {"c": 40.0, "a": -75.0}  # deg, of the turntable and of the head on it


@pytest.fixture(scope="module")
def turned(tmp_path_factory):
    """The machine, its artefact, and a result of it with the axes at ANGLES."""
    folder = tmp_path_factory.mktemp("turned")
    machine = described(folder)
    options = twin.BuildOptions(states=60, training=2, held_out=1, hours=0.5, rich=RichOptions(samples=3))
    twin.build(folder, options=options).save(folder / "a.h5")
    run = shutil.copytree(RUN, folder / "run")
    head, *rows = (run / "loads.csv").read_text(encoding="utf-8").splitlines()
    angles = "".join(f",{angle}" for angle in ANGLES.values())
    lines = [head + "".join(f",{axis}_position [deg]" for axis in ANGLES), *(row + angles for row in rows)]
    (run / "loads.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    artefact = read_artefact(folder / "a.h5")
    write_results(folder / "out", replay(artefact, read_run(run)), {})
    return machine, artefact, folder / "out"


def test_what_turns_stands_where_its_mesh_would_be(turned):
    machine, artefact, out = turned
    turns = surface_turns(artefact.model, artefact.fields)
    assert [turn.axis for turn in turns] == ["c", "a"]
    meshes = load_body_meshes(machine)
    there = meshed_as_turned(machine, meshes, {axis: np.deg2rad(angle) for axis, angle in ANGLES.items()})
    last = read_result(out, artefact).angle[-1]
    for mesh in there:
        field = next(f for f in artefact.fields if f.body == mesh.name)
        outer = [
            p.mesh.facets[:, p.mesh.boundary_facets()] + at for p, at in zip(mesh.parts, mesh.offsets, strict=True)
        ]
        points, moved = turned_surface(turns, field, last, np.tile([1.0, 2.0, 3.0], (len(field.nodes), 1)))
        np.testing.assert_allclose(points, mesh.nodes[np.unique(np.hstack(outer))], atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(moved, axis=1), np.sqrt(14.0))
        straight, _ = turned_surface(turns, field, np.zeros(2))
        np.testing.assert_array_equal(straight, field.nodes)
    assert np.abs(points - field.nodes).max() > 0.05


def test_a_series_has_it_turned(turned):
    _, artefact, out = turned
    first = next(frames_of(artefact, ExportOptions(result=out, frames=2)).frames)
    result = read_result(out, artefact)
    turns, shift = surface_turns(artefact.model, artefact.fields), result.position[0, 0]
    expected = [
        turned_surface(turns, f, result.angle[0])[0] + [shift * (f.body == "slide"), 0.0, 0.0] for f in artefact.fields
    ]
    np.testing.assert_allclose(first.points, np.vstack(expected), atol=1e-12)


def test_so_does_a_picture(turned):
    machine, artefact, out = turned
    angle = read_result(out, artefact).angle[-1]
    expected = np.vstack(
        [turned_surface(surface_turns(artefact.model, artefact.fields), f, angle)[0] for f in artefact.fields]
    )
    np.testing.assert_array_equal(placed_surface(machine, artefact, {}, angle.tolist()).points, expected)
    assert np.abs(placed_surface(machine, artefact, {}).points - expected).max() > 0.05


def test_the_page_draws_it_turned(turned, shown, tmp_path):
    _, artefact, out = turned
    write_page(tmp_path / "index.html", finished_told(artefact, out))
    page = shown().open((tmp_path / "index.html").as_uri())
    page.slide("#time", page.do("page.store.length - 1"))
    drawn = page.do("""() => { page.surface.placed(page.store.surface(page.row), 0);
        return Array.from(page.surface.place.array); }""")
    result = read_result(out, artefact)
    turns, shift = surface_turns(artefact.model, artefact.fields), result.position[-1, 0]
    expected = np.vstack([
        turned_surface(turns, f, result.angle[-1])[0] + [shift * (f.body == "slide"), 0.0, 0.0] for f in artefact.fields
    ])  # fmt: skip
    np.testing.assert_allclose(np.reshape(drawn, (-1, 3)), expected, atol=1e-6)
    assert page.wrong == []
