"""Solvers against each other, several at once, and the choice between them."""

from __future__ import annotations

import gc

import numpy as np
import pytest
import scipy.sparse as sp

from tests.build.parts import STEEL, box
from twin.build import factorize as module
from twin.build.elasticity import solid_elasticity
from twin.build.factorize import SOLVERS, available_solvers, choose, factorize, predicted_bytes
from twin.build.memory import available_memory
from twin.build.surface import mass
from twin.build.thermal import part_matrices
from twin.errors import ModelError

DIRECT = tuple(s for s in available_solvers() if s != "amg")
PART = box("a", (0.0, 0.0, 0.0), (1.0, 0.5, 0.2), (8, 4, 3))


@pytest.fixture(scope="module")
def thermal() -> sp.csr_array:
    E, A0 = part_matrices(PART, STEEL)
    return sp.csr_array(1e-3 * E + A0 + 10.0 * mass(PART, PART.facets("z_max")))


@pytest.fixture(scope="module")
def elastic() -> tuple[sp.csr_array, np.ndarray]:
    """A bar clamped by soft springs on one face, with its six rigid-body motions."""
    K = solid_elasticity(PART.mesh, STEEL).K
    grip = sp.kron(mass(PART, PART.facets("x_min")), 1e12 * sp.eye_array(3))
    rigid = np.zeros((PART.n, 3, 6))
    rigid[:, :, :3] = np.eye(3)
    for i, axis in enumerate(np.eye(3)):
        rigid[:, :, 3 + i] = np.cross(axis, PART.nodes)
    return sp.csr_array(K + grip), rigid.reshape(-1, 6)


def test_superlu_and_amg_are_always_there():
    assert {"superlu", "amg"} <= set(available_solvers()) <= set(SOLVERS)


@pytest.mark.parametrize("solver", available_solvers())
def test_solvers_agree_on_a_thermal_system(solver: str, thermal: sp.csr_array):
    rhs = np.random.default_rng(1).standard_normal((PART.n, 3))
    reference = np.linalg.solve(thermal.toarray(), rhs)
    factor = factorize(thermal, solver=solver)
    assert factor.solver == solver
    np.testing.assert_allclose(factor.solve(rhs), reference, atol=1e-8 * abs(reference).max())
    np.testing.assert_allclose(factor.solve(rhs[:, 1]), reference[:, 1], atol=1e-8 * abs(reference).max())
    assert factor.solve(rhs[:, :0]).shape == (PART.n, 0)
    with pytest.raises(ValueError, match="right-hand side"):
        factor.solve(rhs[:-1])


@pytest.mark.parametrize("solver", available_solvers())
def test_solvers_agree_on_an_elastic_system(solver: str, elastic: tuple[sp.csr_array, np.ndarray]):
    K, rigid = elastic
    rhs = np.zeros(K.shape[0])
    rhs[2::3] = 1.0
    reference = np.linalg.solve(K.toarray(), rhs)
    u = factorize(K, solver=solver, null_space=rigid).solve(rhs)
    np.testing.assert_allclose(u, reference, atol=1e-8 * abs(reference).max())


@pytest.mark.parametrize("solver", available_solvers())
def test_several_factors_live_side_by_side(solver: str, thermal: sp.csr_array):
    rhs = np.random.default_rng(2).standard_normal(PART.n)
    factors = [factorize(sp.csr_array(thermal * (k + 1.0)), solver=solver) for k in range(3)]
    first = factors[0].solve(rhs)
    factors[1].close()
    factors[1].close()  # twice does no harm
    del factors[1]
    gc.collect()
    np.testing.assert_allclose(factors[0].solve(rhs), first, rtol=1e-13)
    np.testing.assert_allclose(3.0 * factors[1].solve(rhs), first, atol=1e-10 * abs(first).max())


@pytest.mark.parametrize("solver", available_solvers())
def test_the_matrix_may_change_after_it_was_factored(solver: str, thermal: sp.csr_array):
    A, rhs = thermal.copy(), np.ones(PART.n)
    factor = factorize(A, solver=solver)
    before = factor.solve(rhs)
    A.data *= 2.0
    np.testing.assert_allclose(factor.solve(rhs), before, rtol=1e-12)


@pytest.mark.parametrize("solver", DIRECT)
def test_equal_input_gives_equal_bits(solver: str, thermal: sp.csr_array):
    rhs = np.random.default_rng(3).standard_normal((PART.n, 2))
    results = [factorize(thermal, solver=solver).solve(rhs).tobytes() for _ in range(3)]
    assert len(set(results)) == 1


@pytest.mark.parametrize("solver", DIRECT)
def test_indefinite_matrices_are_refused(solver: str, thermal: sp.csr_array):
    shift = 1.5 * float(thermal.diagonal().min())
    indefinite = sp.csr_array(thermal - 0.5 * shift * sp.eye_array(PART.n))
    assert (indefinite.diagonal() > 0).all()
    assert np.linalg.eigvalsh(indefinite.toarray())[0] < 0
    with pytest.raises(ModelError, match="not positive definite"):
        factorize(indefinite, solver=solver)


def test_empty_rows_and_shapes_are_refused(thermal: sp.csr_array):
    holes = thermal.tolil()
    holes[3, :] = 0
    holes[:, 3] = 0
    with pytest.raises(ModelError, match="not positive definite"):
        factorize(sp.csr_array(holes))
    with pytest.raises(ValueError, match="not square"):
        factorize(sp.csr_array(thermal[:5]))
    assert factorize(sp.csr_array((0, 0))).solve(np.zeros((0, 2))).shape == (0, 2)


def test_iterations_that_stall_are_reported(monkeypatch: pytest.MonkeyPatch, thermal: sp.csr_array):
    monkeypatch.setattr(module, "MAX_ITERATIONS", 1)
    with pytest.raises(ModelError, match="stall"):
        factorize(thermal, solver="amg").solve(np.ones(PART.n))


def test_the_environment_can_force_a_solver(monkeypatch: pytest.MonkeyPatch, thermal: sp.csr_array):
    monkeypatch.setenv("TWIN_SOLVER", "superlu")
    assert factorize(thermal).solver == "superlu"
    assert factorize(thermal, solver="amg").solver == "amg"  # the argument wins
    monkeypatch.setenv("TWIN_SOLVER", "mumps")
    with pytest.raises(ModelError, match="unknown solver 'mumps'"):
        factorize(thermal)


def test_the_choice_follows_what_is_installed_and_fits(monkeypatch: pytest.MonkeyPatch):
    small, large, gigabytes = (40_000, 1_000_000), (300_000, 8_000_000), 1e9

    def chosen(installed: tuple[str, ...], size: tuple[int, int], memory: float, rhs: int | None = None) -> str:
        monkeypatch.setattr(module, "available_solvers", lambda: installed)
        return choose(*size, rhs_hint=rhs, memory=memory)

    assert chosen(("cholmod", "pardiso", "superlu", "amg"), large, 16 * gigabytes) == "cholmod"
    assert chosen(("pardiso", "superlu", "amg"), large, 16 * gigabytes) == "pardiso"
    assert chosen(("pardiso", "superlu", "amg"), large, 1 * gigabytes) == "amg"
    assert chosen(("superlu", "amg"), small, 16 * gigabytes) == "superlu"
    assert chosen(("superlu", "amg"), large, 16 * gigabytes) == "amg"
    assert chosen(("superlu", "amg"), (80_000, 2_000_000), 16 * gigabytes, rhs=100) == "superlu"
    assert chosen(("superlu", "amg"), (80_000, 2_000_000), 16 * gigabytes, rhs=2) == "amg"
    assert chosen(("superlu",), large, 16 * gigabytes) == "superlu"
    with pytest.raises(ModelError, match="not installed"):
        choose(*small, solver="cholmod")


def test_predicted_memory_is_near_what_was_measured():
    for n, row, peak in ((290_000, 27, 1.8e9), (224_000, 81, 2.3e9), (841_000, 81, 11.1e9)):
        assert predicted_bytes(n, n * row) == pytest.approx(peak, rel=0.2)
    assert 1e8 < available_memory() < 1e15
