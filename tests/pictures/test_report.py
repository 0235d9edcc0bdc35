"""The pictures of a real result of the small machine."""

import shutil

import matplotlib.image
import numpy as np
import pytest

from twin.cli.main import run
from twin.errors import TwinError
from twin.face.report import report
from twin.pictures.placed import described, placed_surface, poses_in_space
from twin.pictures.result import read_result
from twin.rom.artefact import read_artefact


@pytest.fixture
def folder(slide_result, tmp_path):
    return shutil.copytree(slide_result, tmp_path / "out")


@pytest.mark.long
def test_report_draws_every_picture_and_a_page_that_shows_them(slide_artefact, folder, capsys):
    assert run(["report", str(slide_artefact), str(folder)]) == 0
    printed = capsys.readouterr().out
    page = (folder / "index.html").read_text(encoding="utf-8")
    for name in ("temperatures", "tcp", "workspace", "surface"):
        picture = matplotlib.image.imread(folder / f"{name}.png")
        assert min(picture.shape[:2]) > 300, name
        assert picture[..., :3].std() > 0.02, f"{name} is blank"
        assert f'"{name}.png"' in page
        assert f"{name}.png" in printed
    for output in (*read_artefact(slide_artefact).model.sensors, "TCP z"):
        assert page.count(f'["{output} [') == 1  # its row of the certificate


@pytest.mark.slow
def test_equal_results_give_equal_pictures(slide_artefact, folder):
    first = {p: p.read_bytes() for p in report(slide_artefact, folder)}
    assert first == {p: p.read_bytes() for p in report(slide_artefact, folder)}


def test_a_result_of_another_artefact_is_refused(slide_artefact, folder, tmp_path, capsys):
    import h5py

    with h5py.File(folder / "result.h5", "r+") as f:
        f.attrs["artefact"] = "0" * 64
    (folder / "summary.json").unlink()  # which names another file
    with pytest.raises(TwinError, match="another artefact"):
        report(slide_artefact, folder)
    assert run(["report", str(slide_artefact), str(tmp_path)]) == 2
    assert "no result here" in capsys.readouterr().err


def test_the_surface_moves_with_the_axis_and_keeps_its_parts_apart(slide_artefact):
    artefact = read_artefact(slide_artefact)
    machine = described(artefact)
    at_zero, moved = (placed_surface(machine, artefact, {"x": x}) for x in (0.0, 0.15))
    shift = moved.points - at_zero.points
    owner = np.repeat([f.body for f in artefact.fields], [len(f.nodes) for f in artefact.fields])
    np.testing.assert_allclose(shift[owner == "slide"], [[0.15, 0.0, 0.0]] * int((owner == "slide").sum()))
    np.testing.assert_array_equal(shift[owner == "bed"], 0.0)
    assert len(np.unique(at_zero.group)) == len(machine.parts)


def test_the_surface_temperature_agrees_with_a_sensor_on_it(slide_artefact, slide_result):
    """The plate's sensor sits on the surface, amid the plate's top: field basis and sensor row must tell the same."""
    artefact = read_artefact(slide_artefact)
    result = read_result(slide_result, artefact)
    sensor = described(artefact).sensors["plate"].position
    bodies = [b.name for b in artefact.model.bodies]
    (field,) = (f for f in artefact.fields if f.body == "slide")
    first = sum(b.n for b in artefact.model.bodies[: bodies.index("slide")])
    x = result.states[:, first : first + field.basis.shape[1]]
    distance = np.linalg.norm(field.nodes - np.array(sensor), axis=1)
    nearest = distance < 0.03
    surface = artefact.model.reference_temperature + (x @ field.basis[nearest].T).mean(axis=1)
    np.testing.assert_allclose(surface, result.temperature[:, result.sensors.index("plate")], atol=0.05)


def test_poses_in_space_of_a_single_axis(slide_artefact):
    artefact = read_artefact(slide_artefact)
    points = poses_in_space(described(artefact), artefact.model.pose_axes, artefact.model.poses)
    np.testing.assert_allclose(points, np.outer(artefact.model.poses[:, 0], [1.0, 0.0, 0.0]), atol=1e-15)
