"""Kinematics of six struts: what holds for any platform, at drawn poses."""

from __future__ import annotations

import numpy as np
import pytest

from twin.errors import ModelError
from twin.rom.parallel import (
    ZERO,
    Geometry,
    Pose,
    forward,
    frame_spreads,
    inverse,
    joints_spread,
    levers,
    lines,
    moved,
    rotated,
    struts,
)

GROUND = np.array([0.02, -0.01, -0.05])


@pytest.fixture(params=range(4))
def geometry(request) -> Geometry:
    """A platform with joints in pairs, none of them quite where symmetry would have it."""
    rng = np.random.default_rng(request.param)
    signs, thirds = np.tile([1, -1], 3), np.repeat([0, 120, 240], 2)

    def ring(radius: float, aside: float, height: float) -> np.ndarray:
        angle = np.radians(thirds + signs * aside)
        flat = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(6, height)], axis=1)
        return flat + 0.01 * rng.standard_normal((6, 3))

    return Geometry(np.array([0.01, 0.02, 0.15]), ring(0.35, 10, 0.96), ring(0.25, 50, 0.35))


def drawn(seed: int) -> Pose:
    rng = np.random.default_rng(100 + seed)
    return Pose(rng.uniform(-0.03, 0.03, 3), rotated(rng.uniform(-0.1, 0.1, 3)))


@pytest.mark.parametrize("seed", range(5))
def test_forward_is_the_inverse_of_the_inverse(geometry, seed):
    pose = drawn(seed)
    found = forward(geometry, inverse(geometry, pose))
    np.testing.assert_allclose(found.shift, pose.shift, atol=1e-11)
    np.testing.assert_allclose(found.turn, pose.turn, atol=1e-10)
    np.testing.assert_allclose(found.turn @ found.turn.T, np.eye(3), atol=1e-13)


@pytest.mark.parametrize("seed", range(5))
def test_jacobian_against_differences(geometry, seed):
    pose, step = drawn(seed), 1e-6
    for k in range(6):
        motion = step * np.eye(6)[k]
        ahead, behind = (inverse(geometry, moved(pose, s * motion)) for s in (1, -1))
        np.testing.assert_allclose((ahead - behind) / (2 * step), lines(geometry, pose)[:, k], atol=1e-8)


def test_forces_and_wrench_do_the_same_work(geometry):
    """Force balance by hand: the struts push the platform along themselves, at its joints."""
    pose, force = drawn(7), np.array([10.0, -4.0, 7.0, 1.0, -8.0, 3.0])
    _, along = struts(geometry, pose)
    pushes = force[:, None] * along
    wrench = np.concatenate([pushes.sum(axis=0), np.cross(levers(geometry, pose), pushes).sum(axis=0)])
    np.testing.assert_allclose(lines(geometry, pose).T @ force, wrench, atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_all_that_grows_alike_grows_about_the_ground_and_turns_nothing(geometry, seed):
    pose, strain = drawn(seed), 1e-5
    length, _ = struts(geometry, pose)
    grown = strain * (length + joints_spread(geometry, pose) + frame_spreads(geometry, pose, GROUND))
    motion = np.linalg.solve(lines(geometry, pose), grown)
    np.testing.assert_allclose(motion[:3], strain * (geometry.point + pose.shift - GROUND), rtol=1e-12)
    np.testing.assert_allclose(motion[3:], 0.0, atol=1e-16)


def test_spread_of_a_platform_against_one_that_is_larger(geometry):
    """The struts keep their lengths; where the larger platform then stands is Newton's business."""
    strain = 1e-6
    larger = Geometry(geometry.point, geometry.base, geometry.point + (1 + strain) * (geometry.joint - geometry.point))
    short = struts(geometry, ZERO)[0] - struts(larger, ZERO)[0]
    found = forward(larger, short).shift
    told = np.linalg.solve(lines(geometry, ZERO), strain * joints_spread(geometry, ZERO))[:3]
    np.testing.assert_allclose(found, told, rtol=1e-4, atol=1e-12)


def test_lengths_that_do_not_close_are_refused(geometry):
    with pytest.raises(ModelError, match="no platform pose"):
        forward(geometry, np.array([0.5, -0.5, 0.5, -0.5, 0.5, -0.5]))


def test_a_singular_platform_is_refused():
    """Parallel struts hold nothing aside."""
    angle = np.radians(60.0 * np.arange(6))
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(6)], axis=1)
    upright = Geometry(np.zeros(3), ring + [0.0, 0.0, 1.0], ring)
    with pytest.raises(ModelError, match="no platform pose"):
        forward(upright, 0.01 * np.array([1.0, -1.0, 0.5, 0.0, 0.3, -0.2]))
