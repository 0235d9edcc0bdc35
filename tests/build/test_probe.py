"""Temperatures at points."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from skfem import MeshTet2

from tests.build.parts import box, linear
from twin.build.mesh import part_mesh
from twin.build.probe import nearest_in_triangles, probe
from twin.errors import DescriptionError

PART = box("a", (0.0, 0.0, 0.0), (1.0, 0.5, 0.2), (4, 3, 2))


@settings(max_examples=40, deadline=None)
@given(x=st.floats(0, 1), y=st.floats(0, 0.5), z=st.floats(0, 0.2))
def test_quadratic_fields_are_read_exactly_inside(x: float, y: float, z: float):
    nodes, weights = probe(PART, np.array([x, y, z]), "sensors.a")
    p = PART.nodes[nodes]
    assert weights.sum() == pytest.approx(1.0, rel=1e-12)
    assert weights @ linear(p) == pytest.approx(linear(np.array([x, y, z])), abs=1e-12)
    assert weights @ (p[:, 0] * p[:, 1] + p[:, 2] ** 2) == pytest.approx(x * y + z**2, abs=1e-12)


@pytest.mark.parametrize(
    ("point", "foot"),
    [
        ((0.3, 0.2, 0.21), (0.3, 0.2, 0.2)),
        ((-0.01, 0.51, 0.1), (0.0, 0.5, 0.1)),
        ((1.01, -0.01, -0.01), (1.0, 0.0, 0.0)),
    ],
)
def test_sensors_slightly_outside_take_the_nearest_point_of_the_surface(point: tuple, foot: tuple):
    nodes, weights = probe(PART, np.array(point), "sensors.a")
    np.testing.assert_allclose(weights @ PART.nodes[nodes], foot, atol=1e-12)


def test_sensors_far_away_are_refused():
    with pytest.raises(DescriptionError, match="1 m away from part 'a'") as e:
        probe(PART, np.array([0.5, 0.2, 1.2]), "sensors.bed.position")
    assert e.value.problems[0].where == "sensors.bed.position"


def test_points_in_curved_elements_are_found():
    ball = MeshTet2.init_ball(nrefs=2)
    part = part_mesh("ball", ball, {"all": ball.boundary_facets()})
    rng = np.random.default_rng(3)
    for point in rng.standard_normal((20, 3)):
        inside = point / np.linalg.norm(point) * 0.97
        nodes, weights = probe(part, inside, "sensors.a")
        np.testing.assert_allclose(weights @ part.nodes[nodes], inside, atol=1e-10)
    nodes, weights = probe(part, np.array([1.02, 0.0, 0.0]), "sensors.a")
    np.testing.assert_allclose(weights @ part.nodes[nodes], [1.0, 0.0, 0.0], atol=5e-3)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_no_point_of_a_triangle_is_nearer(seed: int):
    rng = np.random.default_rng(seed)
    corners, point = rng.standard_normal((1, 3, 3)), rng.standard_normal(3)
    weights, distance = nearest_in_triangles(corners, point)
    assert weights.min() >= 0
    assert weights.sum() == pytest.approx(1.0)
    others = rng.dirichlet([0.5, 0.5, 0.5], 500) @ corners[0]
    assert distance[0] <= np.linalg.norm(others - point, axis=1).min() + 1e-12
