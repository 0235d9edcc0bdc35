"""The matrices of one solid: patch tests, order of convergence, agreement with scikit-fem's own forms."""

from __future__ import annotations

import numpy as np
import pytest
from skfem import Basis, ElementTetP2, ElementVector, Mesh, MeshTet1, MeshTet2
from skfem.models.elasticity import linear_elasticity

from twin.build import elasticity
from twin.build.elasticity import Elasticity, lame, solid_elasticity, stress
from twin.build.factorize import factorize
from twin.machine.description import Material

IRON = Material(
    conductivity=50.0, density=7200.0, heat_capacity=500.0, youngs_modulus=120e9, poisson_ratio=0.26, expansion=10e-6
)


def box(n: int) -> MeshTet1:
    """n^3 cells of six tetrahedra on a box 1.0 x 0.8 x 0.6 m, its inner nodes shaken off the grid."""
    grid = [np.linspace(0, length, n + 1) for length in (1.0, 0.8, 0.6)]
    mesh = MeshTet1.init_tensor(*grid)
    x, y, z = mesh.p
    shake = 0.15 / n * np.sin(np.pi * x) * np.sin(np.pi * y / 0.8) * np.sin(np.pi * z / 0.6)
    return MeshTet1(mesh.p + shake * np.sin([17 * x + y, 13 * y + z, 11 * z + x]), mesh.t)


def nodes(mesh: Mesh) -> np.ndarray:
    return Basis(mesh, ElementTetP2()).doflocs


def solve_dirichlet(solid: Elasticity, load: np.ndarray, fixed: np.ndarray, values: np.ndarray) -> np.ndarray:
    free = np.setdiff1d(np.arange(solid.K.shape[0]), fixed)
    u = np.zeros(solid.K.shape[0])
    u[fixed] = values[fixed]
    u[free] = factorize(solid.K[free][:, free]).solve((load - solid.K @ u)[free])
    return u


@pytest.mark.parametrize("kind", [MeshTet1, MeshTet2])
def test_stiffness_is_scikit_fems(kind: type[Mesh], monkeypatch: pytest.MonkeyPatch) -> None:
    """... and chunks of elements change nothing."""
    mesh = box(3) if kind is MeshTet1 else MeshTet2.from_mesh(box(3))
    lam, mu, _ = lame(IRON)
    theirs = linear_elasticity(lam, mu).assemble(Basis(mesh, ElementVector(ElementTetP2()), intorder=4))
    monkeypatch.setattr(elasticity, "CHUNK", 37)
    ours = solid_elasticity(mesh, IRON).K
    assert abs(ours - theirs).max() <= 1e-14 * abs(theirs).max()


@pytest.mark.parametrize("kind", [MeshTet1, MeshTet2])
def test_rigid_motion_needs_no_force_and_heat_gives_none(kind: type[Mesh]) -> None:
    mesh = box(3) if kind is MeshTet1 else MeshTet2.from_mesh(box(3))
    solid, x = solid_elasticity(mesh, IRON), nodes(mesh)
    modes = np.zeros((x.shape[1], 3, 6))
    modes[:, :, :3] = np.eye(3)
    modes[:, :, 3:] = np.cross(np.eye(3)[None], x.T[:, None]).transpose(0, 2, 1)
    modes = modes.reshape(-1, 6)
    assert abs(solid.K @ modes).max() <= 1e-12 * abs(solid.K).max()
    assert abs(solid.K - solid.K.T).max() <= 1e-15 * abs(solid.K).max()
    heat = solid.KT @ np.random.default_rng(1).normal(size=x.shape[1])
    assert abs(modes.T @ heat).max() <= 1e-12 * abs(heat).sum()


@pytest.mark.parametrize("kind", [MeshTet1, MeshTet2])
def test_uniform_expansion_is_stress_free(kind: type[Mesh]) -> None:
    mesh = box(3) if kind is MeshTet1 else MeshTet2.from_mesh(box(3))
    solid, x = solid_elasticity(mesh, IRON), nodes(mesh)
    T = np.full(x.shape[1], 7.0)
    exact = IRON.expansion * 7.0 * x.T.ravel()
    corner = int(np.argmin(abs(x).sum(axis=0)))
    on_y = int(np.argmin(abs(x - [[0], [0.8], [0]]).sum(axis=0)))
    on_z = int(np.argmin(abs(x - [[0], [0], [0.6]]).sum(axis=0)))
    held = np.array([3 * corner, 3 * corner + 1, 3 * corner + 2, 3 * on_z, 3 * on_z + 1, 3 * on_y])  # isostatic
    u = solve_dirichlet(solid, solid.KT @ T, held, np.zeros_like(exact))
    assert abs(u - exact).max() <= 1e-10 * abs(exact).max()
    sigma, _ = stress(mesh, IRON, exact, T)
    assert abs(sigma).max() <= 1e-10 * IRON.youngs_modulus * IRON.expansion * 7.0


def test_displacement_converges_with_order_three() -> None:
    """Manufactured: u = grad phi satisfies equilibrium without body force where T = (1 - nu)/(alpha (1 + nu)) lap phi.

    Goodier's potential (Boley and Weiner, 1960, section 3.2). L2 order 3 within 0.1 for quadratic elements.
    """
    k = np.array([2.0, 2.5, 3.0])[:, None]

    def potential_gradient(x: np.ndarray) -> np.ndarray:
        s, c = np.sin(k * x), np.cos(k * x)
        return 1e-4 * k * np.array([c[0] * s[1] * s[2], s[0] * c[1] * s[2], s[0] * s[1] * c[2]])

    def temperature(x: np.ndarray) -> np.ndarray:
        laplacian = -1e-4 * (k**2).sum() * np.sin(k * x).prod(axis=0)
        return (1 - IRON.poisson_ratio) / (IRON.expansion * (1 + IRON.poisson_ratio)) * laplacian

    errors = []
    sizes = (4, 6, 9)
    for n in sizes:
        mesh = box(n)
        basis = Basis(mesh, ElementTetP2(), intorder=6)
        x = basis.doflocs
        boundary = basis.get_dofs().all()
        fixed = (3 * boundary[:, None] + np.arange(3)).ravel()
        solid = solid_elasticity(mesh, IRON)
        u = solve_dirichlet(solid, solid.KT @ temperature(x), fixed, potential_gradient(x).T.ravel()).reshape(-1, 3)
        points = np.asarray(basis.global_coordinates())
        exact = potential_gradient(points.reshape(3, -1)).reshape(points.shape)
        error = np.array([np.asarray(basis.interpolate(u[:, a])) for a in range(3)]) - exact
        errors.append(np.sqrt(((error**2).sum(axis=0) * basis.dx).sum()))
    order = np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert order == pytest.approx(-3.0, abs=0.1)


def test_bar_held_at_both_ends_carries_minus_E_alpha_dT() -> None:
    mesh = box(3)
    solid, x = solid_elasticity(mesh, IRON), nodes(mesh)
    T = np.full(x.shape[1], 5.0)
    ends = np.flatnonzero(np.isclose(x[0], 0.0) | np.isclose(x[0], 1.0))
    side_y, side_z = np.flatnonzero(np.isclose(x[1], 0.0)), np.flatnonzero(np.isclose(x[2], 0.0))
    fixed = np.concatenate([3 * ends, 3 * side_y + 1, 3 * side_z + 2])
    u = solve_dirichlet(solid, solid.KT @ T, fixed, np.zeros(3 * x.shape[1]))
    sigma, _ = stress(mesh, IRON, u, T)
    assert sigma[..., 0, 0] == pytest.approx(-IRON.youngs_modulus * IRON.expansion * 5.0, rel=1e-9)
