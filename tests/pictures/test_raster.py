"""The z-buffer: what is in front is seen, fields are interpolated linearly, areas are right."""

import numpy as np
import pytest

from twin.pictures.raster import Camera, frame, normals, outline, rasterise, shading

FRONT = Camera(azimuth=0.0, elevation=0.0, up=2)  # looks along -x: y to the right, z up


def square(x: float, size: float = 1.0) -> np.ndarray:
    return np.array([[x, 0, 0], [x, size, 0], [x, size, size], [x, 0, size]], dtype=float)


TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])


@pytest.mark.parametrize("up", [0, 1, 2])
@pytest.mark.parametrize(("azimuth", "elevation"), [(0, 0), (-55, 24), (130, -40)])
def test_the_camera_is_a_rotation_with_up_upwards(up, azimuth, elevation):
    axes = Camera(azimuth, elevation, up).axes()
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[1, up] == pytest.approx(np.cos(np.deg2rad(elevation)))
    assert axes[0, up] == pytest.approx(0.0, abs=1e-14)


def test_the_nearer_square_hides_the_farther_one_whatever_the_order():
    near, far = square(1.0, size=0.5), square(0.0)
    for first, second, near_first in ((near, far, True), (far, near, False)):
        raster = rasterise(np.vstack([first, second]), np.vstack([TRIANGLES, TRIANGLES + 4]), FRONT, 200)
        is_first = raster.covered & (raster.triangle < 2)
        share = is_first.sum() / raster.covered.sum()
        assert share == pytest.approx(0.25 if near_first else 0.75, abs=0.01)


def test_the_covered_area_is_the_projected_area():
    raster = rasterise(square(0.0), TRIANGLES, FRONT, 300)
    assert raster.covered.sum() * raster.pixel**2 == pytest.approx(1.0, rel=0.01)


def test_a_linear_field_is_interpolated_exactly_and_the_diagonal_leaves_no_crack():
    points = square(0.0)
    raster = rasterise(points, TRIANGLES, FRONT, 128, frame(points, FRONT, margin=0.0))
    assert raster.covered.all()
    height, width = raster.triangle.shape
    z = 1.0 - (np.arange(height) + 0.5) * raster.pixel
    y = (np.arange(width) + 0.5) * raster.pixel
    picture = raster.interpolate(TRIANGLES, 3.0 * points[:, 1] - 2.0 * points[:, 2] + 7.0)
    np.testing.assert_allclose(picture, 3.0 * y[None, :] - 2.0 * z[:, None] + 7.0, atol=1e-9)


def test_a_common_frame_keeps_the_scale():
    both = frame(np.vstack([square(0.0), square(0.0, size=3.0)]), FRONT)
    small = rasterise(square(0.0), TRIANGLES, FRONT, 300, both)
    assert small.pixel == pytest.approx(3.0 * 1.04 / 300)
    assert small.covered.sum() * small.pixel**2 == pytest.approx(1.0, rel=0.02)


def test_chunks_do_not_change_the_picture(monkeypatch):
    rng = np.random.default_rng(1)
    points, triangles = rng.random((60, 3)), rng.integers(0, 60, (80, 3))
    whole = rasterise(points, triangles, Camera(), 150)
    monkeypatch.setattr("twin.pictures.raster._CHUNK", 1000)
    pieces = rasterise(points, triangles, Camera(), 150)
    np.testing.assert_array_equal(whole.triangle, pieces.triangle)
    np.testing.assert_array_equal(whole.weight, pieces.weight)


def test_outlines_run_between_groups_and_not_through_a_plane():
    points = np.vstack([square(0.0), square(0.0) + [0, 1, 0]])
    triangles = np.vstack([TRIANGLES, TRIANGLES[:, ::-1] + 4])  # opposite winding: still one plane
    raster = rasterise(points, triangles, FRONT, 200)
    n = normals(points, triangles)
    silhouette = outline(raster, n, np.zeros(4, dtype=int), FRONT)
    parted = outline(raster, n, np.array([0, 0, 1, 1]), FRONT)
    inner = slice(20, -20)
    assert not silhouette[inner, 60:140].any()
    assert parted[inner, 60:140].any(axis=1).all()


def test_a_plane_seen_at_a_grazing_angle_has_no_inner_outline():
    tilted = np.array([[0, 0, 0], [40, 1, 0], [40, 1, 1], [0, 0, 1]], dtype=float)  # 40 pixels deep per pixel
    raster = rasterise(tilted, TRIANGLES, FRONT, 200)
    edge = outline(raster, normals(tilted, TRIANGLES), np.zeros(2, dtype=int), FRONT)
    assert raster.covered[100, 60:140].all()
    assert not edge[20:-20, 20:-20].any()


def test_shading_does_not_depend_on_the_winding():
    raster = rasterise(square(0.0), TRIANGLES, FRONT, 50)
    n = normals(square(0.0), TRIANGLES)
    np.testing.assert_allclose(shading(raster, n, FRONT), shading(raster, -n, FRONT))
    assert 0.7 <= shading(raster, n, FRONT)[raster.covered].min() < 1.0
