import numpy as np
import pytest

from twin.pictures.workspace import exaggeration, outer_lines, shares


def grid() -> np.ndarray:
    axes = [np.linspace(-0.4, 0.4, 5), np.linspace(-0.3, 0.3, 5), np.linspace(0.0, 0.5, 5)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def test_shares_of_a_known_field():
    poses = grid()
    shift = np.array([3e-6, -4e-6, 0.0])
    length, linear, rest = shares(poses, np.broadcast_to(shift, poses.shape))
    assert length == pytest.approx(5e-6)
    assert max(linear, rest) < 1e-18
    slope = np.array([[0, 1e-5, 0], [-1e-5, 0, 0], [0, 0, 2e-5]])
    length, linear, rest = shares(poses, (poses - poses.mean(axis=0)) @ slope)
    assert max(length, rest) < 1e-18
    assert linear == pytest.approx(np.sqrt((((poses - poses.mean(axis=0)) @ slope) ** 2).sum(axis=1).mean()))
    bent = np.zeros_like(poses)
    bent[:, 1] = 1e-5 * (poses[:, 0] ** 2 - (poses[:, 0] ** 2).mean())
    length, linear, rest = shares(poses, bent)
    assert max(length, linear) < 1e-18
    assert rest == pytest.approx(bent[:, 1].std())


def test_the_exaggeration_is_round_and_keeps_the_picture_legible():
    poses = grid()
    for largest in (3e-7, 8e-6, 4.4e-5):
        displacement = np.zeros_like(poses)
        displacement[7, 1] = largest
        factor = exaggeration(poses, displacement)
        mantissa = factor / 10 ** np.floor(np.log10(factor) + 1e-9)
        assert min(abs(mantissa - np.array([1, 2, 5]))) < 1e-9
        assert 0.15 * 0.8 / 2.5 <= factor * largest <= 0.15 * 0.8 * 1.0001
    assert exaggeration(poses, np.zeros_like(poses)) == 1.0


def test_outer_lines_of_a_cube_of_125_poses():
    faces, edges = outer_lines((5, 5, 5))
    assert len(edges) == 12
    assert len(faces) == 3 * (25 - 9)  # per direction all lines but those inside
    assert all(len(line) == 5 for line in faces)
    assert outer_lines((4,)) == ([pytest.approx(np.arange(4))], [pytest.approx(np.arange(4))])
