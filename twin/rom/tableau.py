"""How a time step is made of stages: diagonally implicit Runge-Kutta methods with one matrix for all stages.

A stage of a step h of E x' = f - A x solves

    S X_i = r E base_i + f,    S = r E + A,    r = 1/(gamma h),    base_i = x + sum_{j < i} a_ij / gamma (X_j - base_j)

with gamma the diagonal of the Butcher tableau a. The last row of a is also the step's weights (stiffly accurate): the
last stage is the state after it (Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd ed., section IV.6).
The loads f, and the laws in A, are those of the step: the same for all its stages.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Array = Any  # numpy or JAX


@dataclass(frozen=True)
class Tableau:
    """A method. Hashable: compiled steps are specialised on it."""

    name: str
    order: int
    rows: tuple[tuple[float, ...], ...]  # of a, each up to its diagonal; all diagonal entries are alike

    @property
    def diagonal(self) -> float:
        """gamma: r = 1/(gamma h)."""
        return self.rows[0][0]

    @property
    def weights(self) -> tuple[float, ...]:
        """Of the stages' heat flows in the mean flow of a step; they sum to 1."""
        return self.rows[-1]


IMPLICIT_EULER = Tableau("implicit Euler", 1, ((1.0,),))
# Alexander, SIAM J. Numer. Anal. 14, 1977: second order, L-stable
_GAMMA = 1.0 - 0.5**0.5
SDIRK2 = Tableau("SDIRK2", 2, ((_GAMMA,), (1.0 - _GAMMA, _GAMMA)))


def stages(
    tableau: Tableau,
    solve: Callable[[Array, Array], tuple[Array, Array]],
    capacity: Callable[[Array], Array],
    x: Array,
    forcing: Array,
) -> list[tuple[Array, Array]]:
    """The stages of one step from x, the last one being the state after it, each with what its solve has seen.

    solve: right-hand side and a state nearby -> the solution of S X = right-hand side, and the state at which it took
    what its factor leaves out (the solution itself where the factor is exact). capacity: r E times a state. forcing: f.
    States (N,), or (N, k) of k states side by side.
    """
    result: list[tuple[Array, Array]] = []
    moved: list[Array] = []
    near = x
    for row in tableau.rows:
        base = x
        for a, by in zip(row, moved, strict=False):  # the diagonal entry is on the left side
            base = base + a / tableau.diagonal * by
        near, seen = solve(capacity(base) + forcing, near)
        result.append((near, seen))
        if len(result) < len(tableau.rows):
            moved.append(near - base)
    return result
