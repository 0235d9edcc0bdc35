"""How a time step is made of stages: diagonally implicit Runge-Kutta methods with one matrix for all stages.

A stage of a step h of E x' = f - A x solves

    S X_i = r E base_i + f,    S = r E + A,    r = 1/(gamma h),    base_i = x + sum_{j < i} a_ij / gamma (X_j - base_j)

with gamma the diagonal of the Butcher tableau a (Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd ed.,
section IV.6). The loads, and the films in A, are those of the step: the same for all its stages. Only sources whose law
follows the temperature of their surface are read anew for every stage (`Feedback`), at the temperature that the stages
before lead to: a bearing on little mass loses its cold losses within a minute.

The state after a step is x + sum_j b_j / gamma (X_j - base_j); where the weights b are the last row of a (stiffly
accurate) it is the last stage.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

Array = Any  # numpy or JAX
# A state (N,) -> what it adds to the forcing (N,), and the powers (k,) [W] of the sources that follow it.
Feedback = Callable[[Array], tuple[Array, Array]]


@dataclass(frozen=True)
class Tableau:
    """A method. Hashable: compiled steps are specialised on it."""

    name: str
    order: int
    rows: tuple[tuple[float, ...], ...]  # of a, each up to its diagonal; all diagonal entries are alike
    weights: tuple[float, ...]  # b, of the stages' heat flows in the mean flow of a step; they sum to 1
    ahead: tuple[float, ...]  # of the change between the two stages before, by which a stage's loads are read ahead

    @property
    def diagonal(self) -> float:
        """gamma: r = 1/(gamma h)."""
        return self.rows[0][0]

    @property
    def stiffly_accurate(self) -> bool:
        """Whether the last stage is the state after a step."""
        return self.rows[-1] == self.weights

    @cached_property
    def chain(self) -> bool:
        """Whether each stage is an implicit Euler step from the stage before: base_i = X_(i-1)."""
        return len(self.rows) > 1 and all(a == self.diagonal for row in self.rows for a in row)


IMPLICIT_EULER = Tableau("implicit Euler", 1, ((1.0,),), (1.0,), (0.0,))
# Alexander, SIAM J. Numer. Anal. 14, 1977: second order, L-stable
_GAMMA = 1.0 - 0.5**0.5
SDIRK2 = Tableau("SDIRK2", 2, ((_GAMMA,), (1.0 - _GAMMA, _GAMMA)), (1.0 - _GAMMA, _GAMMA), (0.0, 0.0))


def _mean_of_euler_steps(name: str, gamma: float, last: tuple[float, ...]) -> Tableau:
    """Second order from n implicit Euler steps y_1 .. y_n of gamma h each: the state after h is sum_i beta_i y_i.

    On a mode that decays by z within the step R(z) = sum_i beta_i (1 + gamma z)^-i. The last beta are `last`; the first
    three follow from R(0) = 1, R'(0) = -1, R''(0) = 1.
    """
    n = 3 + len(last)
    i = np.arange(1.0, n + 1.0)
    conditions = np.stack([i**0, gamma * i, gamma**2 * i * (i + 1.0)])
    left = 1.0 - conditions[:, 3:] @ last
    beta = np.array([*np.linalg.solve(conditions[:, :3], left), *last])
    b = gamma * beta[::-1].cumsum()[::-1]
    # A stage's loads are read at its own place, i gamma of the step, ahead of the stage before; those of the first at
    # the step's start. Of the one with the largest weight at such a place that the weighted mean of all is at the
    # middle of the step, which second order asks for.
    c = gamma * i
    c[0] = 0.0
    most = int(np.abs(b).argmax())
    c[most] += (0.5 - b @ c) / b[most]
    ahead = (0.0, *(c[1:] / gamma - i[:-1]).tolist())
    return Tableau(name, 2, tuple((gamma,) * k for k in range(1, n + 1)), tuple(b.tolist()), ahead)


# The loads are constant within a step and the machine's matrices are symmetric, so a step's error is that of R(z) for
# exp(-z) at the worst z >= 0. Rational functions with one real pole (one factor) come closest by its minimax choice
# (Saff, Schoenhage, Varga, Numer. Math. 25, 1976; Andersson, J. Approx. Theory 32, 1981). Of those of second order
# with six solves this one has 0.00106: gamma by search, beta by linear programming at each. With four solves the best
# has 0.0088, with five 0.0028; six Euler steps have 0.043, three steps of SDIRK2 0.0089.
SDIRK2_6 = _mean_of_euler_steps("SDIRK2 of six stages", 0.3345, (17.3493, -13.6346, 3.6868))


def stages(
    tableau: Tableau,
    solve: Callable[[Array, Array], tuple[Array, Array]],
    capacity: Callable[[Array], Array],
    x: Array,
    forcing: Array,
    feedback: Feedback | None = None,
) -> tuple[Array, list[tuple[Array, Array, Array]]]:
    """The state after one step from x, and its stages: state, what the solve has seen, powers of the feedback.

    solve: right-hand side and a state nearby -> the solution of S X = right-hand side, and the state at which it took
    what its factor leaves out (the solution itself where the factor is exact). capacity: r E times a state. forcing: f.
    States (N,), or (N, k) of k states side by side. The powers are None without feedback.
    """
    result: list[tuple[Array, Array, Array]] = []
    moved: list[Array] = []

    def beyond(shares: tuple[float, ...]) -> Array:
        state = x
        for share, by in zip(shares, moved, strict=False):
            state = state + share / tableau.diagonal * by
        return state

    before = near = x
    chain = tableau.chain
    for row, ahead in zip(tableau.rows, tableau.ahead, strict=True):
        base = near if chain else beyond(row)  # the stages before: the diagonal entry is on the left side
        more, powers = (0.0, None) if feedback is None else feedback(near + ahead * (near - before))
        before = near
        near, seen = solve(capacity(base) + (forcing if feedback is None else forcing + more), near)
        result.append((near, seen, powers))
        moved.append(near - base)
    return (near if tableau.stiffly_accurate else beyond(tableau.weights)), result
