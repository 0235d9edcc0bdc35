"""The rich basis of a body: rational Krylov over shifts and film coefficients, inputs and output adjoints.

For sampled (s, theta) the basis holds (s E + A(theta))^-1 [B, M, P, C^T, G^T, P_out]. Theorem (Grimme 1997; for
parameters Baur, Beattie, Benner, Gugercin, SIAM J. Sci. Comput. 33, 2011): the Galerkin model interpolates the transfer
function at every sampled (s, theta), and because input and adjoint directions are both in the basis also its
derivatives with respect to s and theta; here up to the small directions that are dropped (`RichOptions`). With moving
contacts as ports, no basis per pose is needed: the position changes only how ports are combined (`twin.rom.contact`).

One shift, or many shifts at one film coefficient, stall at 1e-3 to 1e-2 of the range (docs/decisions/0002); the samples
therefore fill (log s, log theta) jointly. The adjoints are the cheapest accuracy there is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from twin.build.body_matrix import system_matrix
from twin.build.factorize import factorize
from twin.build.project import orthonormalise
from twin.build.workers import workers
from twin.rom.model import AffineBody

LARGEST_AT_ONCE = 100_000  # nodes of a body of which several factors are held in memory


@dataclass(frozen=True)
class RichOptions:
    samples: int = 16  # points in (shift, films)
    shift_low: float = 1e-6  # 1/s: eleven days
    shift_high: float = 1 / 15.0  # 1/s: beyond the 1/(0.3345 * 60 s) that a step of a minute is solved at
    # Directions below this share of a response (E-norm) are dropped, to begin with: it is halved until the basis holds
    # its share of the limits (`twin.build.rich_check`).
    tolerance: float = 8e-3
    seed: int = 0


def sample_points(
    body: AffineBody, low: np.ndarray, high: np.ndarray, options: RichOptions
) -> list[tuple[float, np.ndarray]]:
    """Shifts [1/s] and full theta vectors: Sobol points, log-uniform between the certified bounds low, high (n_theta,).

    The first two samples are the slowest shift at the middle of the box and the fastest one.
    """
    own = list(body.theta)
    centre = np.sqrt(low * high)
    points = [(options.shift_low, centre.copy()), (options.shift_high, centre.copy())]
    count = max(options.samples - 2, 0)
    # drawn as a whole power of two, as Sobol points balance only so
    sobol = qmc.Sobol(1 + len(own), seed=options.seed).random_base2(int(np.ceil(np.log2(max(count, 1)))))
    for u in sobol[:count]:
        theta = centre.copy()
        theta[own] = low[own] * (high[own] / low[own]) ** u[1:]
        points.append((options.shift_low * (options.shift_high / options.shift_low) ** u[0], theta))
    return points


def compress_rows(G: np.ndarray, tolerance: float = 1e-6) -> np.ndarray:
    """The dominant right singular directions (k, n) of the pose rows G (n_poses, 3, n): poses are much correlated.

    Rows between the poses gain nothing from being here: with those of the poses alone, the rich models of the shipped
    machines are off by 0.004 um and less anywhere, as at the poses (benchmark `poses`).
    """
    rows = G.reshape(-1, G.shape[-1])
    if rows.shape[0] == 0:
        return rows
    gram = rows @ rows.T
    eigenvalue, U = np.linalg.eigh(gram)
    use = eigenvalue > tolerance**2 * eigenvalue[-1]
    return U[:, use].T @ rows


def sample_responses(
    body: AffineBody,
    low: np.ndarray,
    high: np.ndarray,
    options: RichOptions = RichOptions(),
    progress: Callable[[str], None] = lambda _: None,
) -> list[np.ndarray]:
    """Responses (n, m) of the body to its inputs and outputs at every sample point, columns of unit E-norm.

    low, high: (n_theta,) bounds of all coefficients of the machine, W/(m^2 K).
    """
    inputs = np.column_stack([body.B, body.M, body.P, body.port_rows.T, body.C.T, compress_rows(body.G).T])
    inputs = inputs[:, np.abs(inputs).max(axis=0) > 0]
    # ports of a symmetric body appear as input and as output: once is enough
    inputs = _distinct(inputs)

    def response(point: tuple[float, np.ndarray]) -> np.ndarray:
        s, theta = point
        factor = factorize(system_matrix(body, theta, s).tocsr(), rhs_hint=inputs.shape[1])
        X = factor.solve(inputs)
        factor.close()
        return X / np.sqrt(np.einsum("ij,ij->j", X, body.E @ X))

    # Samples are independent of each other, and sparse solvers let go of the interpreter: threads will do here.
    points = sample_points(body, low, high, options)
    made = []
    with ThreadPoolExecutor(workers() if body.n < LARGEST_AT_ONCE else 1) as pool:
        for i, X in enumerate(pool.map(response, points)):
            made.append(X)
            progress(f"{body.name}: sample {i + 1}/{options.samples}")
    return made


def basis_of(body: AffineBody, responses: Iterable[np.ndarray], tolerance: float) -> np.ndarray:
    """E-orthonormal basis (n, r) of responses, the constant field first.

    Directions that add less than `tolerance` of a response are dropped. They are added in the order of the samples, so
    the basis does not depend on the number of threads.
    """
    V = body.one[:, None] / np.sqrt(body.one @ body.energy)
    for X in responses:
        V = np.column_stack([V, orthonormalise(X, body.E, V, tolerance)])
    return V


def rich_basis(
    body: AffineBody,
    low: np.ndarray,
    high: np.ndarray,
    options: RichOptions = RichOptions(),
    progress: Callable[[str], None] = lambda _: None,
) -> np.ndarray:
    """E-orthonormal basis (n, r) of the body at the tolerance of `options`, whatever the limits."""
    return basis_of(body, sample_responses(body, low, high, options, progress), options.tolerance)


def _distinct(X: np.ndarray) -> np.ndarray:
    """Columns of X without exact repetitions (up to scale)."""
    scaled = np.round(X / np.linalg.norm(X, axis=0), 12) + 0.0  # no -0
    # by their bytes: np.unique compares columns as records of n fields, in four times the time (n = 40,000)
    first = {column.tobytes(): k for k, column in reversed(list(enumerate(np.ascontiguousarray(scaled.T))))}
    return X[:, sorted(first.values())]
