"""Patches: area means and first moments of surfaces and of clipped segments."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from skfem import FacetBasis, LinearForm, MeshTet2

from tests.build.parts import box, linear
from twin.build.clip import clip, fan, p2_triangle, p2_triangle_gradient, triangle_rule
from twin.build.mesh import part_mesh
from twin.build.surface import facet_nodes, mass, patch, segments
from twin.errors import DescriptionError

X = np.array([1.0, 0.0, 0.0])
PART = box("a", (0.0, 0.1, 0.2), (1.0, 0.3, 0.2), (7, 3, 2))
TOP = PART.facets("z_max")


def test_the_patch_of_a_rectangle():
    p = patch(PART, TOP)
    assert p.area == pytest.approx(0.3, rel=1e-14)
    np.testing.assert_allclose(p.centroid, [0.5, 0.25, 0.4], rtol=1e-14)
    np.testing.assert_allclose(p.normal, [0, 0, 1], atol=1e-14)
    np.testing.assert_allclose(p.second_moment, np.diag([1.0, 0.09, 0.0]) / 12, atol=1e-15)
    assert p.d0.sum() == pytest.approx(1.0, rel=1e-14)
    assert p.d0.shape == (PART.n,)
    assert p.d1.shape == (3, PART.n)


def test_mean_and_moments_of_polynomials_are_exact():
    p, x = patch(PART, TOP), PART.nodes
    assert p.d0 @ linear(x) == pytest.approx(linear(p.centroid), rel=1e-13)
    np.testing.assert_allclose(p.d1 @ linear(x), p.second_moment @ [2.0, -3.0, 0.5], atol=1e-15)
    assert p.d0 @ x[:, 0] ** 2 == pytest.approx(1 / 3, rel=1e-13)  # quadratic fields are in the space
    assert p.d1[0] @ x[:, 0] ** 2 == pytest.approx(1 / 4 - 1 / 6, rel=1e-13)  # mean of (x - 1/2) x^2


def test_normals_point_outwards_on_every_side():
    for i, name in enumerate(("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")):
        outward = np.zeros(3)
        outward[i // 2] = -1 if name.endswith("min") else 1
        np.testing.assert_allclose(patch(PART, PART.facets(name)).normal, outward, atol=1e-14)


def test_segments_agree_with_skfem_where_no_facet_is_cut():
    part = box("b", (0.0, 0.0, 0.0), (1.0, 0.3, 0.2), (4, 2, 1))
    top = part.facets("z_max")
    left = top[part.mesh.p[0, part.mesh.facets[:, top]].max(axis=0) < 0.5 + 1e-9]
    basis = FacetBasis(part.mesh, part.basis.elem, facets=left, dofs=part.dofs)
    np.testing.assert_allclose(
        segments(part, top, X, 2)[0].d0, LinearForm(lambda v, _: v).assemble(basis) / 0.15, atol=1e-15
    )


@settings(max_examples=30, deadline=None)
@given(n=st.integers(2, 40), angle=st.floats(-0.4, 0.4))
def test_segments_share_out_the_surface_and_reproduce_linear_fields(n: int, angle: float):
    direction = np.array([np.cos(angle), np.sin(angle), 0.0])
    found, whole = segments(PART, TOP, direction, n), patch(PART, TOP)
    np.testing.assert_allclose(sum(s.area * s.d0 for s in found), whole.area * whole.d0, atol=1e-15)
    for s in found:
        assert s.d0 @ linear(PART.nodes) == pytest.approx(linear(s.centroid), rel=1e-12)
        np.testing.assert_allclose(s.d1 @ linear(PART.nodes), s.second_moment @ [2.0, -3.0, 0.5], atol=1e-14)
    stations = np.array([s.centroid @ direction for s in found])
    assert (np.diff(stations) > 0).all()


def test_equal_segments_of_a_rectangle_have_equal_areas_and_centred_stations():
    found = segments(PART, TOP, X, 12)
    np.testing.assert_allclose([s.area for s in found], 0.3 / 12, rtol=1e-12)
    np.testing.assert_allclose([s.centroid[0] for s in found], (np.arange(12) + 0.5) / 12, rtol=1e-13)


def test_segments_along_the_normal_are_refused():
    with pytest.raises(DescriptionError, match="no length along the axis"):
        segments(PART, TOP, np.array([0.0, 0.0, 1.0]), 3)
    with pytest.raises(DescriptionError, match="without area"):
        patch(PART, TOP[:0])


def test_mass_integrates_products():
    M, x = mass(PART, TOP), PART.nodes
    assert np.ones(PART.n) @ M @ np.ones(PART.n) == pytest.approx(0.3, rel=1e-13)
    assert x[:, 0] ** 2 @ M @ x[:, 0] ** 2 == pytest.approx(0.3 / 5, rel=1e-13)
    np.testing.assert_allclose(M @ np.ones(PART.n), 0.3 * patch(PART, TOP).d0, atol=1e-16)
    assert abs(M - M.T).max() < 1e-18


def test_curved_facets_have_the_area_of_the_ball():
    ball = MeshTet2.init_ball(nrefs=2)
    part = part_mesh("ball", ball, {"all": ball.boundary_facets()})
    facets = part.facets("all")
    p = patch(part, facets)
    assert p.area == pytest.approx(4 * np.pi, rel=2e-3)
    np.testing.assert_allclose(p.normal, 0.0, atol=1e-12)  # a closed surface
    np.testing.assert_allclose(mass(part, facets) @ np.ones(part.n), p.area * p.d0, atol=1e-6)
    slices = segments(part, facets, X, 7)
    assert sum(s.area for s in slices) == pytest.approx(p.area, rel=1e-4)
    for s in slices:
        assert s.d0 @ linear(part.nodes) == pytest.approx(linear(s.centroid), rel=1e-12)


def test_facet_nodes_are_corners_then_the_edges_between_them():
    x = PART.nodes[facet_nodes(PART, PART.mesh.boundary_facets())]
    for edge, (i, j) in enumerate(((0, 1), (1, 2), (2, 0))):
        np.testing.assert_allclose(x[:, 3 + edge], (x[:, i] + x[:, j]) / 2, atol=1e-16)


def test_shape_functions_and_their_gradients():
    corners_and_edges = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0.5, 0], [0, 0.5, 0.5], [0.5, 0, 0.5]])
    np.testing.assert_allclose(p2_triangle(corners_and_edges), np.eye(6), atol=1e-15)
    at, h = triangle_rule(5)[0], 1e-6
    for k, step in enumerate(([-h, h, 0], [-h, 0, h])):
        difference = (p2_triangle(at + step) - p2_triangle(at - np.array(step))) / (2 * h)
        np.testing.assert_allclose(p2_triangle_gradient(at)[..., k], difference, atol=1e-9)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_clipping_divides_the_area_of_polygons(seed: int):
    rng = np.random.default_rng(seed)
    triangles = rng.random((20, 3, 2))
    counts = np.full(20, 3)
    normal, offset = rng.standard_normal(2), rng.standard_normal()
    signed = triangles @ normal - offset

    def area(polygons: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        pieces, owner = fan(polygons, sizes)
        twice = np.abs(np.linalg.det(pieces[:, 1:] - pieces[:, :1]))
        return np.bincount(owner, twice / 2, minlength=20)

    inside, outside = clip(triangles, counts, signed), clip(triangles, counts, -signed)
    np.testing.assert_allclose(area(*inside) + area(*outside), area(triangles, counts), atol=1e-14)
    kept, sizes = inside
    for polygon, size in zip(kept, sizes, strict=True):
        assert (polygon[:size] @ normal - offset >= -1e-12).all()
