"""A Galerkin basis of few states fitted to the transfer function, by the gradient of its error.

    H_r = C V (V^T S V)^-1 V^T B,    S = s E + A(theta),    V holds the uniform field

Hund, Mitchell, Mlinaric, Saak, SIAM J. Sci. Comput. 44, 2022. The error of a Galerkin projection is a product of what V
misses of the responses and of the adjoints of outputs (docs/decisions/0015): a basis may make these small, or
orthogonal to each other, which no choice of modes by what they capture can see to. Whatever V is, the reduced model is
stable for every theta >= 0.

The derivative of H_r by V goes through the reduced matrices only: with X = S_r^-1 B_r and Y = S_r^-1 C_r^T it is
dH_r = dC_r X + Y^T dB_r - Y^T dS_r X, and all frequencies of one theta share one eigendecomposition.

The start decides. From the default's own basis, or from the right projection matrix of balanced truncation alone, the
gradient gains little; from the first columns of its right and of its left one, half of each,
whose error is four times as large, to a quarter of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
import scipy.linalg
import scipy.optimize

from twin.build.compress import Tolerances, balanced_directions, galerkin
from twin.build.frequency_training import FREQUENCIES
from twin.build.project import project
from twin.build.scenario import theta_bounds
from twin.rom.model import AffineBody, MachineModel

MOST_STATES = 64  # above, the work grows with their cube, and there are enough of them
# L-BFGS on means of growing powers of the squared errors, the last of which come near the largest of them.
POWERS, ITERATIONS, MEMORY = (1, 4, 16), 400, 40
LARGEST = 200  # power whose mean is the largest, for comparison
GRAMIANS, SEED = 8, 7  # as of `balanced`


@dataclass(frozen=True)
class Fit:
    """A dense symmetric body with E = 1, and what its reduced model is fitted to."""

    body: AffineBody
    films: np.ndarray  # (m, n_theta) W/(m^2 K)
    omega: np.ndarray  # (n_omega,) rad/s
    heat: float  # W of every source beside 1 K outside of every film; 0 leaves sources out

    @cached_property
    def exact(self) -> tuple[np.ndarray, np.ndarray]:
        """H (m, n_omega, n_out, n_in) divided by its largest singular value at each theta, and these (m,)."""
        made = []
        for theta in self.films:
            rate, U = np.linalg.eigh(self.body.A0 + np.tensordot(theta[self._own], self._A, axes=1))
            inner = 1.0 / (rate + 1j * self.omega[:, None])
            made.append((self.body.C @ U * inner[:, None]) @ (U.T @ self._inputs(self.body.M, self.body.B, theta)))
        size = np.array([np.linalg.norm(H, 2, axis=(1, 2)).max() for H in made])
        return np.array(made) / size[:, None, None, None], size

    @cached_property
    def _own(self) -> list[int]:
        return list(self.body.theta)

    @cached_property
    def _A(self) -> np.ndarray:
        return np.array(self.body.A).reshape(-1, self.body.n, self.body.n)

    def _inputs(self, M: np.ndarray, B: np.ndarray, theta: np.ndarray) -> np.ndarray:
        return np.column_stack([M * theta[self._own], self.heat * B]) if self.heat else M * theta[self._own]

    @cached_property
    def scale(self) -> np.ndarray:
        """(n, n): columns of unit stiffness at the middle of the films, so that all parameters count alike."""
        middle = np.exp(np.log(self.films).mean(axis=0))
        rate, U = np.linalg.eigh(self.body.A0 + np.tensordot(middle[self._own], self._A, axes=1))
        return np.asarray(U / np.sqrt(rate))

    @cached_property
    def _terms(self) -> np.ndarray:
        """(1 + n_terms, n, n): A0 and A_k."""
        return np.concatenate([self.body.A0[None], self._A])

    def basis(self, parameters: np.ndarray) -> np.ndarray:
        """V (n, r), the uniform field first."""
        free = parameters.reshape(self.body.n, -1)
        return np.column_stack([self.body.one / np.linalg.norm(self.body.one), self.scale @ free])

    def parameters(self, V: np.ndarray) -> np.ndarray:
        """Those of a basis (n, r) whose span holds the uniform field."""
        one = self.body.one / np.linalg.norm(self.body.one)
        V = np.linalg.qr(V)[0]
        rest = np.linalg.svd(V - np.outer(one, one @ V))[0][:, : V.shape[1] - 1]
        return np.asarray(np.linalg.solve(self.scale, rest)).ravel()

    def loss(self, parameters: np.ndarray, power: int) -> tuple[float, np.ndarray]:
        """log of the mean of the squared errors (Frobenius over inputs and outputs) to a power, by that; its gradient.

        Errors are those at every theta and frequency, as shares of the largest singular value of the exact one there.
        """
        V = self.basis(parameters)
        AV = self._terms @ V
        reduced, E, C, M, B = V.T @ AV, V.T @ V, self.body.C @ V, V.T @ self.body.M, V.T @ self.body.B
        errors, solved = [], []
        for theta, H, size in zip(self.films, *self.exact, strict=True):
            rate, U = scipy.linalg.eigh(reduced[0] + np.tensordot(theta[self._own], reduced[1:], axes=1), E)
            inner = 1.0 / (rate + 1j * self.omega[:, None])[:, :, None]
            X, Y = inner * (U.T @ self._inputs(M, B, theta)), inner * (C @ U).T  # in the eigenvectors: (n_omega, r, ..)
            errors.append((C @ U) @ X / size - H)
            solved.append((U, X, Y))
        miss = np.array([(np.abs(e) ** 2).sum(axis=(1, 2)) for e in errors])
        largest = miss.max()
        mean = ((miss / largest) ** power).mean()
        weight = 2.0 * (miss / largest) ** (power - 1) / (largest * mean * miss.size)
        dA, dE, dC = np.zeros_like(reduced), np.zeros_like(E), np.zeros_like(C)
        dM, dB = np.zeros_like(M), np.zeros_like(B)
        for theta, size, e, w, (U, X, Y) in zip(self.films, self.exact[1], errors, weight, solved, strict=True):
            g = w[:, None, None] * e.conj() / size  # d loss = Re sum g dH
            gX = g @ X.transpose(0, 2, 1)
            dC += gX.sum(axis=0).real @ U.T
            of_inputs = U @ (Y @ g).sum(axis=0).real
            dM += of_inputs[:, : M.shape[1]] * theta[self._own]
            if self.heat:
                dB += self.heat * of_inputs[:, M.shape[1] :]
            of_A, of_E = (
                -U @ np.tensordot(f * Y, gX, axes=((0, 2), (0, 1))).real @ U.T
                for f in (1.0, 1j * self.omega[:, None, None])
            )
            dE += of_E
            dA[0] += of_A
            dA[1:] += theta[self._own][:, None, None] * of_A
        dV = np.einsum("kij,kjl->il", AV, dA + dA.transpose(0, 2, 1), optimize=True)
        dV += V @ (dE + dE.T) + self.body.C.T @ dC + self.body.M @ dM.T + self.body.B @ dB.T
        return float(np.log(largest) + np.log(mean) / power), (self.scale.T @ dV[:, 1:]).ravel()

    def fitted(self, start: np.ndarray, iterations: int = ITERATIONS) -> np.ndarray:
        """The basis (n, r), orthonormal, that L-BFGS finds from a basis (n, r) whose span holds the uniform field."""
        x = self.parameters(start)
        options = {"maxiter": iterations, "maxfun": 2 * iterations, "maxcor": MEMORY, "ftol": 0.0, "gtol": 0.0}
        for power in POWERS:
            loss = partial(self.loss, power=power)
            x = scipy.optimize.minimize(loss, x, jac=True, method="L-BFGS-B", options=options).x
        return np.asarray(np.linalg.qr(self.basis(x))[0])

    def largest(self, V: np.ndarray) -> float:
        """The largest error of a basis (n, r), as a share of the transfer function, about."""
        return float(np.exp(self.loss(self.parameters(V), LARGEST)[0] / 2.0))


def mixed_directions(rich: MachineModel, snapshots: list[np.ndarray], states: int, unit: Tolerances) -> np.ndarray:
    """(n, states): the uniform field, and of the directions of `balanced` half right, half left ones; of one body."""
    ((body,), (X,)) = rich.bodies, snapshots
    low, high = theta_bounds(rich.load_model)
    right, left, _ = balanced_directions(body, X, unit, low, high, GRAMIANS, np.random.default_rng(SEED))
    half = states // 2
    return np.column_stack([body.one, right[:, :half], left[:, : states - 1 - half]])


def fitted_galerkin(
    rich: MachineModel,
    snapshots: list[np.ndarray],
    states: int,
    unit: Tolerances,
    films: Sequence[np.ndarray],
    heat: float = 0.0,
) -> MachineModel:
    """Galerkin projection of a machine of one body, E = 1, on a fitted basis; `galerkin` where that is no better.

    snapshots: `responses` at the films; films: thetas (n_theta,) [W/(m^2 K)]. Outputs are the sensors. heat: W of every
    source that count as much as 1 K outside of a film.
    """
    (body,) = rich.bodies
    fit = Fit(body, np.array(films), np.r_[0.0, FREQUENCIES], heat)
    whole = replace(rich, bodies=(replace(body, V=np.eye(body.n)),))
    plain = galerkin(whole, snapshots, states, unit).bodies[0].V
    assert plain is not None
    start = mixed_directions(rich, snapshots, states, unit)
    bases = [plain] if start.shape[1] < states else [plain, fit.fitted(start)]
    return replace(rich, bodies=(project(body, min(bases, key=fit.largest)),))
