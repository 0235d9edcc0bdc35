"""A reduced body whose matrices are fitted to the transfer function, stable by its form: what a stable model can reach.

    s z + (A0 + sum_k theta_k A_k) z = sum_k theta_k A_k 1,  y = C z,   A0 = N F0 F0^T N^T,  A_k = F_k F_k^T,  N^T 1 = 0

All matrices are symmetric and positive semidefinite, hence stable for every theta >= 0; a uniform temperature is exact
and the heat balance closes, as after a Galerkin projection. But they are no congruence of the full ones: F and C are
free (as in Mlinaric and Gugercin, SIAM J. Sci. Comput. 45, 2023, whose models are not tied to a projection either).
"""

from __future__ import annotations

import twin.run.jax_setup  # noqa: F401  isort: skip  before numpy: JAX's LAPACK is SciPy's OpenBLAS

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
import scipy.optimize
from jax.flatten_util import ravel_pytree

from twin.rom.model import AffineBody

# L-BFGS first on the mean square of the errors, then on a mean of eighth powers, which comes near the largest.
POWERS, MEMORY = (1, 4), 40


def _root(A: np.ndarray) -> np.ndarray:
    """F (r, r) with F F^T = A + a little: a column of zeros would have no gradient."""
    value, U = np.linalg.eigh((A + A.T) / 2)
    return np.asarray(U * np.sqrt(np.maximum(value, 1e-14 * value[-1])))


def _in_numpy(slope: Callable[..., tuple[jax.Array, jax.Array]]) -> Callable[[np.ndarray], tuple[float, np.ndarray]]:
    def told(x: np.ndarray) -> tuple[float, np.ndarray]:
        value, gradient = slope(x)
        return float(value), np.asarray(gradient)

    return told


def fitted(
    start: AffineBody, films: list[np.ndarray], omega: np.ndarray, exact: list[np.ndarray], iterations: int
) -> AffineBody:
    """The body `start` (dense, symmetric, E = 1) with matrices fitted to transfer functions, one per theta.

    films: thetas (n_films,) [W/(m^2 K)]; exact: H (n_omega, n_out, n_films) at each; omega (n_omega,) rad/s. Errors
    count as shares of the largest singular value of each H.
    """
    middle = np.exp(np.mean(np.log(films), axis=0))
    rate, U = np.linalg.eigh(start.A0 + np.tensordot(middle, np.array(start.A), axes=1))
    to = U / np.sqrt(rate)  # z = to xi: unit stiffness at the middle of the films, so that all entries count alike
    one = np.sqrt(rate) * (U.T @ start.one)
    N = scipy.linalg.null_space(one[None])
    first = {
        "A0": _root(N.T @ (to.T @ start.A0 @ to) @ N),
        "A": np.array([_root(m * (to.T @ A @ to)) for m, A in zip(middle, start.A, strict=True)]),
        "C": start.C @ to,
    }
    flat, unravel = ravel_pytree(first)
    theta = jnp.asarray(np.array(films) / middle)
    size = np.array([np.linalg.norm(H, 2, axis=(1, 2)).max() for H in exact])
    wanted = jnp.asarray(np.array(exact) / size[:, None, None, None])
    dynamic = jnp.asarray(1j * omega[:, None, None] * np.diag(1 / rate))

    def miss(parameters: dict[str, jax.Array], case: tuple[jax.Array, jax.Array, jax.Array]) -> jax.Array:
        """Squared errors (n_omega,), all inputs and outputs together."""
        t, H, scale = case
        A = jnp.einsum("kij,klj->kil", parameters["A"], parameters["A"])
        L = N @ parameters["A0"]
        S = L @ L.T + jnp.tensordot(t, A, axes=1) + dynamic
        B = (t[:, None] * (A @ one)).T
        X = jnp.linalg.solve(S, jnp.broadcast_to(B.astype(complex), (len(omega), *B.shape)))
        return jnp.sum(jnp.abs(parameters["C"] @ X / scale - H) ** 2, axis=(1, 2))

    def loss(x: jax.Array, power: int) -> jax.Array:
        each = jax.lax.map(lambda case: miss(unravel(x), case), (theta, wanted, jnp.asarray(size)))
        return jnp.log(jnp.mean(each**power)) / power

    slope = jax.jit(jax.value_and_grad(loss), static_argnames="power")
    x = np.asarray(flat)
    for power in POWERS:
        options = {"maxiter": iterations, "maxfun": 2 * iterations, "maxcor": MEMORY, "ftol": 0.0, "gtol": 0.0}
        x = scipy.optimize.minimize(
            _in_numpy(partial(slope, power=power)), x, jac=True, method="L-BFGS-B", options=options
        ).x
    found = {name: np.asarray(value) for name, value in unravel(x).items()}
    back = (U * np.sqrt(rate)).T  # xi = back z
    L = N @ found["A0"]
    A = tuple(back.T @ (F @ F.T / m) @ back for F, m in zip(found["A"], middle, strict=True))
    return replace(
        start, A0=back.T @ L @ L.T @ back, A=A, M=np.column_stack([a @ start.one for a in A]), C=found["C"] @ back
    )
