"""Surfaces joined across meshes that do not match."""

from __future__ import annotations

import time

import numpy as np
import pytest
from skfem import MeshTet1

from tests.build.parts import box, linear, stacked
from twin.build.interface import interface
from twin.build.mesh import BodyMesh, body_mesh, part_mesh
from twin.build.surface import mass
from twin.errors import DescriptionError


@pytest.mark.parametrize(
    ("a", "b"), [((1, 1, 1), (1, 1, 1)), ((3, 4, 1), (5, 2, 2)), ((2, 2, 1), (7, 9, 1)), ((4, 4, 1), (8, 8, 1))]
)
def test_fields_without_a_jump_feel_nothing(a: tuple[int, int, int], b: tuple[int, int, int]):
    body = stacked(a, b)
    joint = interface(body, "a.z_max", "b.z_min")
    assert joint.area == pytest.approx(1.0, rel=1e-12)
    np.testing.assert_allclose(joint.matrix @ np.ones(body.n), 0.0, atol=1e-14)
    np.testing.assert_allclose(joint.matrix @ linear(body.nodes), 0.0, atol=1e-13)
    np.testing.assert_allclose(joint.matrix @ body.nodes[:, 0] ** 2, 0.0, atol=1e-13)  # P2 is on both sides
    assert abs(joint.matrix - joint.matrix.T).max() < 1e-15


def test_jumps_are_integrated_exactly():
    body = stacked((3, 4, 1), (5, 2, 2))
    joint = interface(body, "a.z_max", "b.z_min")
    x = body.nodes
    on_b = np.arange(body.n) >= body.offsets[1]
    # jump 2 x^2 + y with T_A = x^2 + y and T_B = -x^2: int (2 x^2 + y)^2 over the unit square
    T = np.where(on_b, -(x[:, 0] ** 2), x[:, 0] ** 2 + x[:, 1])
    assert T @ joint.matrix @ T == pytest.approx(4 / 5 + 2 / 3 + 1 / 3, rel=1e-12)


def test_one_side_alone_sees_its_own_mass_matrix():
    body = stacked((3, 4, 1), (5, 2, 2))
    a, offset = body.parts[0], body.offsets[1]
    joint = interface(body, "a.z_max", "b.z_min").matrix
    assert abs(joint[:offset, :offset] - mass(a, a.facets("z_max"))).max() < 1e-14


def overlapping(angle: float) -> tuple[BodyMesh, float]:
    """A plate turned by `angle` on a larger block, and the plate's area."""
    block = box("a", (-1.0, -1.0, 0.0), (2.0, 2.0, 0.2), (6, 5, 1))
    straight = box("b", (-0.5, -0.3, 0.2), (1.0, 0.6, 0.1), (4, 3, 1))
    c, s = np.cos(angle), np.sin(angle)
    turned = MeshTet1(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ straight.mesh.p, straight.mesh.t)
    return body_mesh("a", (block, part_mesh("b", turned, straight.surfaces))), 0.6


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 4, 2.0])
def test_the_common_area_of_surfaces_that_overlap_in_part(angle: float):
    body, area = overlapping(angle)
    joint = interface(body, "a.z_max", "b.z_min")
    assert joint.area == pytest.approx(area, rel=1e-12)
    np.testing.assert_allclose(joint.matrix @ linear(body.nodes), 0.0, atol=1e-13)
    assert interface(body, "b.z_min", "a.z_max").area == pytest.approx(area, rel=1e-12)


def test_coordinates_rounded_by_a_mesher_still_meet():
    a = box("a", (0.0, 0.0, 0.0), (1.0, 1.0, 0.2), (3, 4, 1))
    b = box("b", (0.0, 0.0, 0.2000001), (1.0, 1.0, 0.3), (5, 2, 1))
    assert interface(body_mesh("a", (a, b)), "a.z_max", "b.z_min").area == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize(
    ("origin", "surface"),
    [((0.0, 0.0, 0.3), "z_min"), ((2.0, 0.0, 0.2), "z_min"), ((0.0, 0.0, 0.2), "x_min"), ((1.0, 0.0, 0.2), "z_min")],
)
def test_surfaces_that_do_not_meet_are_refused(origin: tuple[float, float, float], surface: str):
    a, b = box("a", (0.0, 0.0, 0.0), (1.0, 1.0, 0.2), (3, 4, 1)), box("b", origin, (1.0, 1.0, 0.3), (5, 2, 1))
    with pytest.raises(DescriptionError, match="no common area") as e:
        interface(body_mesh("a", (a, b)), "a.z_max", f"b.{surface}", where="contacts.plate")
    assert e.value.problems[0].where == "contacts.plate"


def test_faces_turned_away_from_each_other_do_not_join():
    a, b = box("a", (0.0, 0.0, 0.0), (1.0, 1.0, 0.2), (3, 4, 1)), box("b", (0.0, 0.0, 0.0), (1.0, 1.0, 0.2), (2, 2, 1))
    with pytest.raises(DescriptionError, match="no common area"):
        interface(body_mesh("a", (a, b)), "a.z_max", "b.z_max")


def test_thousands_of_facets_take_seconds():
    body = stacked((30, 30, 1), (41, 37, 1))
    start = time.perf_counter()
    joint = interface(body, "a.z_max", "b.z_min")
    assert time.perf_counter() - start < 5.0
    assert joint.area == pytest.approx(1.0, rel=1e-11)
    np.testing.assert_allclose(joint.matrix @ linear(body.nodes), 0.0, atol=1e-14)
