"""Shares of the volumetric error on fields whose shares are known, and TCP displacements at any number of poses."""

from __future__ import annotations

import numpy as np
import pytest

from tests.build.test_structure import meshes, structure
from twin.build.volumetric import displacements, grid_points, volumetric_shares

CUBE = grid_points([np.linspace(-1.0, 1.0, 5), np.linspace(-0.4, 0.4, 5), np.linspace(0.0, 2.0, 5)])


def shares(error, positions=CUBE):
    s = volumetric_shares(positions, error)
    return np.array([s.shift, s.linear, s.higher])


def test_a_pure_shift():
    np.testing.assert_allclose(shares(np.tile([3e-6, -1e-6, 2e-6], (125, 1))), [1, 0, 0], atol=1e-14)


def test_a_linear_field_without_a_mean():
    slope = np.random.default_rng(0).normal(size=(3, 3))
    np.testing.assert_allclose(shares(1e-6 * (CUBE - CUBE.mean(axis=0)) @ slope), [0, 1, 0], atol=1e-14)


def test_a_quadratic_field():
    """x^2 over five places -1 .. 1: mean 1/2, mean square 17/40; nothing is linear by symmetry."""
    error = np.zeros((125, 3))
    error[:, 2] = 1e-6 * CUBE[:, 0] ** 2
    np.testing.assert_allclose(shares(error), [10 / 17, 0, 7 / 17], atol=1e-14)


def test_mixed_parts_share_by_their_squares():
    """3 of shift, 4 (rms) of a linear and 5 (rms) of a product x y: orthogonal over the grid."""
    x, y = CUBE[:, 0] / np.sqrt(0.5), CUBE[:, 1] / np.sqrt(0.08)
    error = np.column_stack([np.full(125, 3.0), 4.0 * x, 5.0 * x * y])
    np.testing.assert_allclose(shares(error), [9 / 50, 16 / 50, 25 / 50], atol=1e-14)


def test_an_axis_that_does_not_move_and_one_pose():
    flat = np.column_stack([np.linspace(0, 1, 7), np.full(7, 0.3)])
    error = np.column_stack([1.0 + flat[:, 0], np.zeros(7), np.zeros(7)])
    assert shares(error, flat)[2] < 1e-20
    np.testing.assert_allclose(shares(np.ones((1, 3)), np.zeros((1, 3))), [1, 0, 0])


def test_no_error_has_no_shares():
    assert np.isnan(shares(np.zeros((125, 3)))).all()


def test_displacements_are_the_structures_own():
    rng = np.random.default_rng(1)
    fields = [[rng.normal(size=body.n) for body in meshes()] for _ in range(3)]
    positions = np.array([[-0.17], [0.0], [0.2]])
    many = displacements(structure(), positions, fields)
    assert many.shape == (3, 3, 3)
    for i, field in enumerate(fields):
        for j, position in enumerate(positions):
            one = structure().displacement(position, field)
            np.testing.assert_allclose(many[i, j], one, rtol=0, atol=1e-9 * np.abs(one).max())


def test_grid_points_in_c_order():
    points = grid_points([np.array([0.0, 1.0]), np.array([5.0, 6.0, 7.0])])
    np.testing.assert_array_equal(points, [[0, 5], [0, 6], [0, 7], [1, 5], [1, 6], [1, 7]])


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_shares_do_not_depend_on_units(scale):
    rng = np.random.default_rng(2)
    error = rng.normal(size=(125, 3))
    np.testing.assert_allclose(shares(scale * error, CUBE / scale), shares(error), atol=1e-12)
