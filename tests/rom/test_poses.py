"""Interpolation between the poses of the grid."""

import numpy as np
import pytest

from twin.rom.poses import axis_weights, pose_weights

GRID = (np.linspace(0.0, 0.8, 5), np.array([-0.2, 0.0, 0.1, 0.5]), np.linspace(0.0, 0.6, 3))
POSES = np.stack(np.meshgrid(*GRID, indexing="ij"), axis=-1).reshape(-1, 3)
KINDS = ["linear", "cubic", "lagrange"]
RNG = np.random.default_rng(0)
INSIDE = RNG.uniform([0.0, -0.2, 0.0], [0.8, 0.5, 0.6], (200, 3))


@pytest.mark.parametrize("kind", KINDS)
def test_exact_at_the_nodes(kind):
    weights, outside = pose_weights(GRID, POSES, kind)
    np.testing.assert_array_equal(weights, np.eye(len(POSES)))
    assert not outside.any()


@pytest.mark.parametrize("kind", KINDS)
def test_reproduces_linear_functions(kind):
    weights, _ = pose_weights(GRID, INSIDE, kind)
    np.testing.assert_allclose(weights @ POSES, INSIDE, atol=1e-14)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-14)


def test_cubic_reproduces_cubics_and_lagrange_the_fourth_power():
    nodes, s = np.linspace(0.0, 1.0, 5), RNG.uniform(0.0, 1.0, 50)
    np.testing.assert_allclose(axis_weights(nodes, s, "cubic") @ nodes**3, s**3, atol=1e-14)
    np.testing.assert_allclose(axis_weights(nodes, s, "lagrange") @ nodes**4, s**4, atol=1e-14)
    assert np.abs(axis_weights(nodes, s, "cubic") @ nodes**4 - s**4).max() > 1e-4


@pytest.mark.parametrize(("kind", "order"), [("linear", 2.0), ("cubic", 4.0)])
def test_interpolation_converges_at_its_order(kind, order):
    s = RNG.uniform(0.0, 1.0, 2000)
    error = []
    for n in (17, 33):
        nodes = np.linspace(0.0, 1.0, n)
        error.append(np.abs(axis_weights(nodes, s, kind) @ np.sin(5 * nodes) - np.sin(5 * s)).max())
    assert np.log2(error[0] / error[1]) == pytest.approx(order, abs=0.2)


@pytest.mark.parametrize("kind", KINDS)
def test_continuous_across_nodes(kind):
    nodes = GRID[1]
    just = axis_weights(nodes, nodes[1:-1] - 1e-12, kind) - axis_weights(nodes, nodes[1:-1] + 1e-12, kind)
    assert np.abs(just).max() < 1e-10


def test_outside_holds_and_is_told():
    weights, outside = pose_weights(GRID, np.array([[0.9, 0.0, 0.3], [0.4, -0.3, 0.3], [0.8, 0.5, 0.6]]))
    assert outside.tolist() == [True, True, False]
    np.testing.assert_allclose(weights @ POSES, [[0.8, 0.0, 0.3], [0.4, -0.2, 0.3], [0.8, 0.5, 0.6]], atol=1e-14)


def test_an_axis_with_one_pose_and_no_axis_at_all():
    weights, _ = pose_weights((np.array([0.4]), GRID[0]), np.array([[0.4, 0.3]]))
    np.testing.assert_allclose(weights @ np.linspace(0.0, 0.8, 5), 0.3)
    assert pose_weights((), np.zeros((4, 0)))[0].shape == (4, 1)
