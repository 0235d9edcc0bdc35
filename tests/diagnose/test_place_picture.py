"""The picture of a place marks what a cause's place is, and the channels that told it by their shares."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.diagnose import small_case
from tests.diagnose.made_up import SHELL, diagnosis
from tests.diagnose.test_search import measured
from tests.support.descriptions import SLIDE
from twin.build.places import Place
from twin.diagnose.report.place import channels_told, place_html, place_picture
from twin.diagnose.report.scene import scene_of
from twin.diagnose.search.accepted import parameter_of
from twin.diagnose.search.forward import search
from twin.diagnose.search.support import shared, support_of
from twin.machine.load import load_machine
from twin.pictures.marked import best_camera, marked_view
from twin.pictures.network import layout
from twin.pictures.raster import Camera
from twin.pictures.surface import SurfaceMesh


def drifting() -> np.ndarray:
    """Measurements in which the second sensor drifts by 3 K in four hours."""
    study, y = small_case.study(), measured(seed=2)
    first = 0
    for k in study.fitted:
        (b, s), _ = study.runs[k].shapes
        y[first : first + b * s].reshape(b, s)[:, 1] += study.runs[k].measured.bin_time * 3.0 / 14400.0
        first += study.runs[k].size
    return y


@pytest.mark.long
def test_one_channel_carries_a_sensor_at_fault_and_several_carry_heat():
    detector = small_case.made_detector()
    alone = support_of(search(detector, drifting()))
    assert alone.shares[0][0] == "housing"
    assert alone.participation == pytest.approx(1.0, abs=0.1)
    found = search(detector, measured("heat", "slide", 60.0, seed=3))
    assert found.accepted
    several = support_of(found)
    assert several.participation > 1.1 * alone.participation
    assert sum(share for _, share in several.shares) == pytest.approx(1.0)
    assert {name for name, _ in several.shares} == {"front", "housing", "screw_middle", "dx", "dy", "dz"}


@pytest.mark.long
def test_a_loss_out_of_its_tolerance_rests_on_the_channel_beside_it():
    detector, rng = small_case.made_detector(), np.random.default_rng(4)
    study = detector.study
    x = np.zeros(len(study.scale))
    x[parameter_of(study, "sources.nut")] = 5.0
    y = study.all_outputs(x)
    found = search(detector, y + detector.whiten.colour(rng.standard_normal(len(y))))
    assert [(a.hypothesis.family, a.hypothesis.name) for a in found.accepted] == [("loss_law", "sources.nut")]
    name, share = support_of(found).shares[0]
    assert name == "screw_middle"
    assert share > 0.5


@pytest.mark.long
def test_nothing_rests_on_nothing():
    assert support_of(search(small_case.made_detector(), measured(seed=1))) is None
    assert shared({"a": -1.0, "b": 0.0}) is None


def test_alike_channels_count_as_many_as_they_are_and_what_speaks_against_counts_not():
    assert shared({"a": 2.0, "b": 2.0, "c": 2.0, "d": 2.0}).participation == pytest.approx(4.0)
    ratio = shared({"a": 9.0, "b": 1.0, "c": -5.0})
    assert ratio.shares == (("a", 0.9), ("b", 0.1), ("c", 0.0))
    assert ratio.participation == pytest.approx(1.0 / 0.82)


def probed(*places: Place) -> SimpleNamespace:
    load = SimpleNamespace(sources=(), films=(), environments=())
    return SimpleNamespace(places=places, base=SimpleNamespace(load_model=load))


def test_a_surface_a_joint_and_a_source_are_found_on_the_meshes():
    machine = load_machine(SLIDE)
    end = Place("bed.x_max", ("bed",), (("bed", "x_max"),), "", 0.03)
    scene = scene_of(machine, probed(end), "bed.x_max")
    assert scene.marked == ("bed.x_max",)
    shell = scene.machine
    own = shell.triangles[shell.surface == shell.names.index("bed.x_max")]
    assert shell.points[own][..., 0] == pytest.approx(0.4)
    assert set(scene_of(machine, probed(), "contacts.rail_1").marked) == {"bed.z_max", "rail_1.z_min"}
    source = next(name for name, s in machine.sources.items() if s.surface)
    assert scene_of(machine, probed(), f"sources.{source}").marked == (machine.sources[source].surface,)
    assert scene_of(machine, probed(), "sensors.plate").marked == ()
    assert set(scene.sensors) == {n for n, s in machine.sensors.items() if s.part}


def test_nodes_of_a_network_are_found_by_node_contact_and_source():
    machine = small_case.machine()
    scene = scene_of(machine, probed(Place("shaft", ("shaft",), (), "", 0.1)), "shaft")
    assert scene.marked == ("shaft",)
    contact = next(name for name, c in machine.contacts.items() if c.surfaces)
    wanted = {s.partition(".")[0] for s in machine.contacts[contact].surfaces}
    assert set(scene_of(machine, probed(), f"contacts.{contact}").marked) == wanted


def test_the_camera_goes_where_the_place_shows():
    box = SHELL.machine
    mesh = SurfaceMesh(box.points, box.triangles, box.part)
    seen = {}
    for k, name in enumerate(box.names):
        view = marked_view(mesh, box.surface == k, (1.0, 0.0, 0.0), 2, 120)
        seen[name] = view.seen
        red = (view.pixels[..., 0] > 0.9 * view.pixels[..., :3].max(axis=-1)) & (view.pixels[..., 1] < 0.1)
        assert red.sum() > 200, name
    assert min(seen.values()) > 0.95
    usual = Camera.from_front(2)
    assert best_camera(mesh, box.surface == box.names.index("bed.z_max"), 2) == usual
    assert best_camera(mesh, box.surface == box.names.index("bed.z_min"), 2).elevation < 0.0


def test_what_is_hidden_shines_through():
    """A face between two boxes is in no view."""
    box = SHELL.machine
    points = np.vstack([box.points, box.points + [1.0, 0.0, 0.0]])
    mesh = SurfaceMesh(points, np.vstack([box.triangles, box.triangles + 8]), np.repeat([0, 1], 12))
    marked = np.concatenate([box.surface == box.names.index("bed.x_max"), np.zeros(12, dtype=bool)])
    view = marked_view(mesh, marked, (1.0, 0.0, 0.0), 2, 120)
    assert view.seen < 0.1
    tinted = view.pixels[..., 0] > 1.3 * view.pixels[..., 1]
    assert tinted.sum() > 200


def test_a_network_is_laid_out_by_its_links():
    links = [(0, 1), (1, 2), (2, 3), (1, 4), (1, 5)]
    where = layout(6, links)
    apart = np.linalg.norm(where[:, None] - where, axis=2)
    assert max(apart[a, b] for a, b in links) < min(apart[0, 3], apart[4, 3])
    assert min(apart[0, 4], apart[0, 5], apart[4, 5]) > 0.5  # leaves of one node are not on one point
    assert np.array_equal(where, layout(6, links))
    assert np.ptp(where[:, 0]) >= np.ptp(where[:, 1])
    assert np.isfinite(layout(3, [(0, 1)])).all()  # a piece apart


@pytest.mark.long
def test_a_picture_says_where_and_what_is_left_of_the_channels():
    for verdict, title in (("named", "Where: bed.y_min"), ("sensor", "Where: sensor x_nut")):
        d = diagnosis(verdict)
        picture = place_picture(d, d.scene)
        assert picture.title == title
        numbers = [t.get_text() for t in picture.figure.axes[0].texts]
        assert "1" in numbers
        told = channels_told(d)
        assert "TCP dx" in told
        assert "sensor_3" in told
        before = float(np.sqrt(np.mean(d.series[0].recalibrated[:, 0] ** 2)))
        assert f'<td class="number">{before:.3f} K</td>' in told
    assert place_html(replace(diagnosis("named"), scene=None)) == ""
