"""First-order responses of everything that may act anywhere, in one pass through the runs.

About the calibrated trajectory z(t) a cause of small amplitude enters as a forcing f(t) = v(t) s(t): v the place, s its
history. All are stepped together as columns of one linear system with the matrices of the nominal run and the steps of
`twin.diagnose.model.integration`. The laws' own reaction is left out here, and is in the exact refit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import numpy as np
import scipy.linalg

from twin.diagnose.model.probed_loads import gammas
from twin.diagnose.model.study import Study
from twin.rom.step_loads import Tabulated, film_loads
from twin.rom.tableau import SDIRK2, stages

AT_ONCE = 700  # columns


@dataclass(frozen=True)
class Nominal:
    """The nominal run k as the linear integration needs it; n steps."""

    states: np.ndarray  # (n + 1, r)
    total: np.ndarray  # (n, n_films) W/(m^2 K), radiation included
    convection: np.ndarray  # (n, n_films)
    outer: np.ndarray  # (n, n_films) K above the reference temperature
    inverse: np.ndarray  # (n, r, r) of S, float32
    rate: float  # 1/s

    @property
    def middle(self) -> np.ndarray:
        """(n, r) states that the two stages of a step see in the mean."""
        return 0.5 * (self.states[:-1] + self.states[1:])


def nominal_run(study: Study, k: int) -> Nominal:
    """Trajectory and matrices of run k at nominal parameters."""
    probed = study.probed
    states = study.states(k, np.zeros(len(probed.parameters)))
    system, loads = (jax.tree.map(np.asarray, own) for own in (probed.system, study.runs[k].run.loads))
    layout = probed.layout
    n, n_films = len(loads.rate), layout.n_films
    plan, T_ref = system.film_plan, float(system.reference_temperature)
    P, A0, A = system.P[0], system.A0[0], system.A[0]
    rate = float(loads.rate[0])
    total, convection, outer = (np.zeros((n, n_films)) for _ in range(3))
    inverse = np.zeros((n, *A0.shape), dtype=np.float32)
    gamma = gammas(probed.contacts, loads, np.ones(probed.contacts.n_contacts))
    for i in range(n):
        told = Tabulated(loads.theta[i, :n_films], layout.following_films, loads.film_table[i])
        films = film_loads(np, plan, told, system.surfaces(states[i]), loads.environment[i], loads.position[i], 1.0)
        total[i], convection[i], outer[i] = films.total, films.convection, films.outer - T_ref
        coefficients = np.concatenate([films.total, loads.theta[i, n_films:]])
        S = rate / SDIRK2.diagonal * np.eye(len(A0)) + A0 + np.tensordot(coefficients - system.nominal, A, 1)
        factor = scipy.linalg.cho_factor(S + P @ gamma[i] @ P.T, lower=True)
        inverse[i] = scipy.linalg.cho_solve(factor, np.eye(len(S)))
    return Nominal(states, total, convection, outer, inverse, rate)


@dataclass(frozen=True)
class Column:
    """A forcing: vector of a place or flow (n, r) times a history (n,), per run of the study."""

    vector: int  # index of the vector
    histories: tuple[np.ndarray | None, ...]  # per run of the study; None: not in that run
    at_start: bool = False  # no forcing: the vector is what the state begins with there, and the history is zero
    across: float = 0.0  # W/K that conduct beside the forcing, between the two sides of a constant vector


def respond(
    study: Study, nominal: Sequence[Nominal], vectors: Sequence[Sequence[np.ndarray]], columns: Sequence[Column]
) -> np.ndarray:
    """(m, n_columns) responses of all measured quantities of the fitted runs, float32.

    vectors: per run of the study, (r,) constant or (n, r) each.
    """
    rows = study.rows
    result = np.zeros((rows[-1].stop, len(columns)), dtype=np.float32)
    for k, own in zip(study.fitted, rows, strict=True):
        acting = [c for c, column in enumerate(columns) if column.histories[k] is not None]
        for begin in range(0, len(acting), AT_ONCE):
            chosen = acting[begin : begin + AT_ONCE]
            result[own, chosen] = _integrated(study, k, nominal[k], vectors[k], [columns[c] for c in chosen])
    return result


def _integrated(
    study: Study, k: int, nominal: Nominal, vectors: Sequence[np.ndarray], columns: Sequence[Column]
) -> np.ndarray:
    planned = study.runs[k]
    (body,) = study.probed.base.bodies
    n_steps, r = len(nominal.states) - 1, body.n
    C = body.C[planned.measured.column].astype(np.float32)
    used, which = np.unique([c.vector for c in columns], return_inverse=True)
    S = np.stack([np.asarray(c.histories[k], dtype=np.float32) for c in columns], axis=1)  # (n_steps, n)
    begins = [vectors[c.vector] if c.at_start else np.zeros(r) for c in columns]
    X = np.stack(begins, axis=1).astype(np.float32)
    T = np.zeros((n_steps + 1, len(C), len(columns)), dtype=np.float32)
    T[0] = C @ X
    step, share = planned.rows.step, planned.rows.share
    needed = {int(s) for s in step} | {int(s) + 1 for s in step}
    kept = {0: X}
    V = np.empty((r, len(used)), dtype=np.float32)
    for j, v in enumerate(used):
        V[:, j] = vectors[v] if vectors[v].ndim == 1 else 0.0
    changing = [(j, vectors[v]) for j, v in enumerate(used) if vectors[v].ndim == 2]
    rate = np.float32(nominal.rate / SDIRK2.diagonal)
    across = np.array([c.across for c in columns], dtype=np.float32)
    conducts = np.flatnonzero(across)
    kappa, d = across[conducts], V[:, which[conducts]]

    def solve(t: int, right: np.ndarray, near: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        X = nominal.inverse[t] @ right
        if len(conducts):  # (S + kappa d d^T)^-1 from S^-1 (Sherman, Morrison, Ann. Math. Stat. 21, 1950)
            W = nominal.inverse[t] @ d
            X[:, conducts] -= W * (kappa * (d * X[:, conducts]).sum(axis=0) / (1.0 + kappa * (d * W).sum(axis=0)))
        return X, X

    for t in range(n_steps):
        for j, vector in changing:
            V[:, j] = vector[t]
        known = V[:, which] * S[t]
        X, _ = stages(SDIRK2, partial(solve, t), lambda X: rate * X, X, known)
        T[t + 1] = C @ X
        if t + 1 in needed:
            kept[t + 1] = X
    means = np.tensordot(planned.measured.mean_of.astype(np.float32), T, 1)
    rows = np.asarray(planned.rows.row)  # (k, 3, r)
    w = np.zeros((len(step), 3, len(columns)))
    for q in range(len(step)):
        now = kept[int(step[q])] + share[q] * (kept[int(step[q]) + 1] - kept[int(step[q])])
        w[q] = rows[q] @ now
    if planned.measured.from_first and len(w):
        w = w - w[0]
    n = len(columns)
    return np.concatenate([means.reshape(-1, n), w.reshape(-1, n)])
