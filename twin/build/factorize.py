"""One interface to direct and iterative solvers of symmetric positive definite systems.

The best of what is installed is taken: CHOLMOD (scikit-sparse), MKL PARDISO (pypardiso), SuperLU for small systems,
conjugate gradients preconditioned by smoothed aggregation (pyamg) for large ones and whenever a direct factor would not
fit the memory. The environment variable TWIN_SOLVER or the argument `solver` forces one of
"cholmod", "pardiso", "superlu", "amg".
"""

from __future__ import annotations

import importlib.util
import os
import sys
import weakref
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from twin.build.memory import available_memory
from twin.errors import ModelError

SOLVERS = ("cholmod", "pardiso", "superlu", "amg")
SUPERLU_LIMIT = 50_000  # unknowns: above, SuperLU is ten times slower than the supernodal solvers
MEMORY_SHARE = 0.7  # of the available memory that a factor may take
TOLERANCE = 1e-12  # relative residual of the iterative solver
MAX_ITERATIONS = 500
AMG_BREAK_EVEN = 6  # right-hand sides below which iterating beats SuperLU beyond its limit


class Factor(ABC):
    """A symmetric positive definite matrix ready to be solved with. Several may live at once; `close` frees one."""

    solver: str  # which of SOLVERS
    n: int

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """A^-1 rhs for rhs (n,) or (n, k). Raises ModelError where iterations do not converge."""
        rhs = np.asarray(rhs, dtype=float)
        if rhs.ndim not in (1, 2) or rhs.shape[0] != self.n:
            raise ValueError(f"right-hand side of shape {rhs.shape} for {self.n} unknowns")
        if rhs.size == 0:
            return np.zeros(rhs.shape)
        return self._solve(rhs)

    @abstractmethod
    def _solve(self, rhs: np.ndarray) -> np.ndarray: ...

    @abstractmethod
    def close(self) -> None:
        """Free the factor's memory; it cannot be used afterwards. Dropping the last reference does the same."""


def factorize(
    A: sp.csr_array,
    rhs_hint: int | None = None,
    solver: str | None = None,
    null_space: np.ndarray | None = None,
    refine: int = 0,
) -> Factor:
    """Factor a symmetric positive definite matrix (n, n), both triangles stored.

    rhs_hint: how many right-hand sides are expected, which decides between SuperLU and iterations where neither
    CHOLMOD nor PARDISO is installed. null_space: (n, k) vectors with little energy, for the iterative solver (six rigid
    motions of an elastic body, whose unknowns are 3 * node + component); the constant by default. refine: steps of
    iterative refinement of PARDISO, for ill-conditioned systems (bodies held at three nodes gain two digits); each
    costs more than a solution. A thermal system is solved to the last digits without.

    Raises ModelError for matrices that are not positive definite, and solvers that are unknown or not installed.
    """
    A = sp.csr_array(A)
    if A.shape[0] != A.shape[1]:
        raise ValueError(f"a matrix of shape {A.shape} is not square")
    if A.shape[0] == 0:
        return _Empty()
    if not (A.diagonal() > 0).all():
        raise _not_definite()
    name = choose(A.shape[0], A.nnz, rhs_hint, solver or os.environ.get("TWIN_SOLVER") or None)
    if name == "amg":
        return _Amg(A, null_space)
    direct: dict[str, Callable[[sp.csr_array], Factor]] = {
        "cholmod": _Cholmod,
        "pardiso": partial(_Pardiso, refine=refine),
        "superlu": _SuperLU,
    }
    return direct[name](A)


def available_solvers() -> tuple[str, ...]:
    """Those of SOLVERS that are installed here, the preferred one first."""
    modules = {"cholmod": "sksparse", "pardiso": "pypardiso", "superlu": "scipy", "amg": "pyamg"}
    return tuple(s for s in SOLVERS if importlib.util.find_spec(modules[s]) is not None)


def choose(
    n: int, nnz: int, rhs_hint: int | None = None, solver: str | None = None, memory: float | None = None
) -> str:
    """The solver for n unknowns and nnz entries with `memory` [bytes] free (default: what this computer has free).

    Raises ModelError for a forced `solver` that is unknown or not installed.
    """
    installed = available_solvers()
    if solver is not None:
        if solver not in SOLVERS:
            raise ModelError(f"unknown solver '{solver}'", "TWIN_SOLVER", f"solvers are: {', '.join(SOLVERS)}")
        if solver not in installed:
            remedy = f"installed are: {', '.join(installed)}"
            raise ModelError(f"solver '{solver}' is not installed", "TWIN_SOLVER", remedy)
        return solver
    direct = next((s for s in ("cholmod", "pardiso") if s in installed), None)
    fits = predicted_bytes(n, nnz) < MEMORY_SHARE * (available_memory() if memory is None else memory)
    if direct and fits:
        return direct
    if "amg" not in installed:
        return direct or "superlu"  # nothing better: let it try
    few = rhs_hint is not None and rhs_hint <= AMG_BREAK_EVEN
    if direct is None and fits and (n <= SUPERLU_LIMIT or (n <= 2 * SUPERLU_LIMIT and not few)):
        return "superlu"
    return "amg"


def predicted_bytes(n: int, nnz: int) -> float:
    """Memory of a Cholesky factor of a three-dimensional mesh: ~ n^(4/3) with nested dissection (George 1973).

    The constant is fitted to measured peaks: 1.8 GB for 290k thermal, 2.3 and 11.1 GB for 224k and 841k elastic ones.
    """
    return 18.0 * (nnz / n) ** 0.5 * n ** (4.0 / 3.0)


class _Empty(Factor):
    solver, n = "none", 0

    def _solve(self, rhs: np.ndarray) -> np.ndarray:
        return rhs

    def close(self) -> None:
        return


class _Cholmod(Factor):
    solver = "cholmod"

    def __init__(self, A: sp.csr_array):
        from sksparse.cholmod import CholmodError, cholesky

        self.n = A.shape[0]
        try:
            self._factor = cholesky(sp.csc_matrix(A), mode="supernodal")
        except CholmodError as e:
            raise _not_definite() from e

    def _solve(self, rhs: np.ndarray) -> np.ndarray:
        return np.asarray(self._factor(rhs))

    def close(self) -> None:
        self._factor = None


class _Pardiso(Factor):
    """MKL PARDISO, matrix type 2 (symmetric positive definite) from the upper triangle."""

    solver = "pardiso"

    def __init__(self, A: sp.csr_array, refine: int = 0):
        # Same input, same bits: MKL otherwise picks kernels by memory alignment, which changes from run to run.
        os.environ.setdefault("MKL_CBWR", "AUTO,STRICT")
        _tell_where_mkl_is()
        from pypardiso.pardiso_wrapper import PyPardisoError, PyPardisoSolver

        self.n = A.shape[0]
        upper = sp.csr_matrix(sp.triu(A, format="csr"))
        upper.sort_indices()
        upper.indices, upper.indptr = upper.indices.astype(np.int32), upper.indptr.astype(np.int32)
        self._upper = upper
        self._pardiso = PyPardisoSolver(mtype=2)
        # where it had to search, tell the next one
        os.environ.setdefault("PYPARDISO_MKL_RT", str(self._pardiso.libmkl._name))
        self._pardiso.set_iparm(1, 1)  # the following are ours, zeros would all mean "default"
        self._pardiso.set_iparm(2, 2)  # METIS, serial: the parallel ordering is not reproducible
        self._pardiso.set_iparm(8, refine)  # steps of iterative refinement
        self._finalizer = weakref.finalize(self, self._pardiso.free_memory, everything=True)
        self._pardiso.set_phase(12)
        try:
            self._pardiso._call_pardiso(upper, np.zeros((self.n, 1)))
        except PyPardisoError as e:
            self.close()
            if e.value == -2:
                raise _no_memory(self.n) from e
            raise _not_definite() from e

    def _solve(self, rhs: np.ndarray) -> np.ndarray:
        # pypardiso's own solve() compares or hashes the whole matrix each time
        self._pardiso.set_phase(33)
        return self._pardiso._call_pardiso(self._upper, np.asfortranarray(rhs))

    def close(self) -> None:
        self._finalizer()


class _SuperLU(Factor):
    solver = "superlu"

    def __init__(self, A: sp.csr_array):
        self.n = A.shape[0]
        try:
            self._lu = splu(
                sp.csc_matrix(A), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError as e:
            raise _not_definite() from e
        except MemoryError as e:
            raise _no_memory(self.n) from e
        if not (self._lu.U.diagonal() > 0).all():  # without pivoting the pivots of L L^T
            raise _not_definite()

    def _solve(self, rhs: np.ndarray) -> np.ndarray:
        return self._lu.solve(rhs)

    def close(self) -> None:
        self._lu = None


class _Amg(Factor):
    """Conjugate gradients with smoothed aggregation (Vanek, Mandel and Brezina, Computing 56, 1996)."""

    solver = "amg"

    def __init__(self, A: sp.csr_array, null_space: np.ndarray | None):
        import pyamg

        self.n = A.shape[0]
        self._A = sp.csr_matrix(A, copy=True)
        elastic = null_space is not None and null_space.shape[1] >= 3 and self.n % 3 == 0
        sweep: tuple[str, dict[str, Any]] = ("gauss_seidel", {"sweep": "symmetric"})
        if elastic:
            sweep = ("block_gauss_seidel", {"sweep": "symmetric", "blocksize": 3})
        levels = pyamg.smoothed_aggregation_solver(
            sp.bsr_matrix(self._A, blocksize=(3, 3)) if elastic else self._A,
            B=null_space,
            symmetry="hermitian",
            strength=("symmetric", {"theta": 0.05 if elastic else 0.0}),
            presmoother=sweep,
            postsmoother=sweep,
            max_coarse=500,
            coarse_solver="splu",  # the default, a dense pseudo-inverse, takes minutes
        )
        self._preconditioner = levels.aspreconditioner()

    def _solve(self, rhs: np.ndarray) -> np.ndarray:
        columns = rhs.reshape(self.n, -1)
        return np.stack([self._iterate(b) for b in columns.T], axis=1).reshape(rhs.shape)

    def _iterate(self, b: np.ndarray) -> np.ndarray:
        from scipy.sparse.linalg import cg

        if not b.any():
            return np.zeros(self.n)
        x, stalled = cg(self._A, b, rtol=TOLERANCE, maxiter=MAX_ITERATIONS, M=self._preconditioner)
        if stalled:
            residual = float(np.linalg.norm(self._A @ x - b) / np.linalg.norm(b))
            if not residual < 1e-9:  # rounding may keep an ill-conditioned system from reaching the last digits
                raise ModelError(
                    f"conjugate gradients stall at a relative residual of {residual:.1e}",
                    "factorize",
                    "install pypardiso or scikit-sparse, or use a coarser mesh; is a body without films or supports?",
                )
        return x

    def close(self) -> None:
        self._preconditioner = None


def _tell_where_mkl_is() -> None:
    """pypardiso searches every folder of the environment for MKL, twice, half a second each; pip puts it into one."""
    folders = (Path(sys.prefix) / "lib", Path(sys.prefix) / "Library" / "bin")
    found = sorted((str(path) for folder in folders for path in folder.glob("*mkl_rt*")), key=len)
    if found:
        os.environ.setdefault("PYPARDISO_MKL_RT", found[0])


def _no_memory(n: int) -> ModelError:
    return ModelError(
        f"not enough memory to factor {n} unknowns", "factorize", "use a coarser mesh, or TWIN_SOLVER=amg"
    )


def _not_definite() -> ModelError:
    return ModelError(
        "the system is not positive definite",
        "factorize",
        "a body without any film or joint (thermal, steady), or without supports (elastic), has no unique solution",
    )
