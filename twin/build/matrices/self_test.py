"""Are matrices what they are taken for? What physics says of K, C and the films holds, or it is told why not.

- C is symmetric, every unknown has a capacity, the sum of all entries is the heat content of 1 K.
- K is symmetric, and a uniform temperature conducts nothing: K 1 = 0. A time step's effective matrix C/dt + K has
  K 1 = C 1/dt instead, which is what an Ansys .full file of a transient analysis holds; convection that was left in has
  K 1 > 0 at the nodes of its surface.
- A film is symmetric and takes up heat at some nodes; the sum of its entries is its area.
- A row of outputs is a temperature (it sums to 1) or a difference of temperatures (it sums to 0).
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from twin.build.matrices.files import Matrices
from twin.errors import DescriptionError, Problem

# Of the largest sum of sizes of a row: exports have 6 digits at the least, and a wrong matrix is off by its own size.
ROUNDING = 1e-5
ALIKE = 1e-3  # spread of dt over the nodes, relative, of an effective matrix; convection changes it at the surface only
RECIPE = (
    "export three times: K without convection; with a film coefficient of 1 on one surface at a time, A1 being the "
    "difference; C from a run of its own"
)


def self_test(matrices: Matrices) -> tuple[str, ...]:
    """One line per matrix with what was found. Raises DescriptionError with everything that is wrong."""
    problems: list[Problem] = []
    told = [*_capacity(matrices, problems), *_conduction(matrices, problems)]
    for name, film in matrices.films.items():
        told += _film(name, film, matrices.given[f"film {name}"], problems)
    if not matrices.films:
        problems.append(
            Problem(
                "no film: without heat exchange there is no steady temperature", matrices.given["conduction"], RECIPE
            )
        )
    told += [*_outputs(matrices, problems), *_inputs(matrices, problems)]
    if problems:
        raise DescriptionError.collect(problems)
    return tuple(told)


def _size(matrix: sp.csr_matrix) -> float:
    return float(abs(matrix).sum(axis=1).max()) if matrix.shape[0] else 0.0


def _symmetric(matrix: sp.csr_matrix, name: str, where: str, problems: list[Problem]) -> None:
    off = float(abs(matrix - matrix.T).max())
    if off <= ROUNDING * _size(matrix):
        return
    triangle = sp.tril(matrix, -1).nnz == 0 or sp.triu(matrix, 1).nnz == 0
    problems.append(
        Problem(
            f"{name} holds one triangle only" if triangle else f"{name} is not symmetric, by {off:.2g}",
            where,
            "write it whole, or with 'symmetric' in the header of the Matrix Market file"
            if triangle
            else "conduction and capacity are: was a flow or a constraint left in?",
        )
    )


def _capacity(matrices: Matrices, problems: list[Problem]) -> list[str]:
    E, where = matrices.capacity, matrices.given["capacity"]
    _symmetric(E, "C", where, problems)
    without = np.flatnonzero(E.diagonal() <= 0.0)
    if without.size:
        problems.append(
            Problem(
                f"{without.size} unknowns have no heat capacity, the first is number {without[0] + 1}",
                where,
                "take unknowns without capacity, such as constrained ones, out of all matrices",
            )
        )
    total = float(E.sum())
    if total <= 0.0:
        problems.append(
            Problem(f"the heat content of 1 K is {total:.4g} J", where, "it is the sum of rho c V: check C")
        )
    return [f"C: symmetric; {total:.6g} J/K in all, which must be rho c V"]


def _conduction(matrices: Matrices, problems: list[Problem]) -> list[str]:
    K, where = matrices.conduction, matrices.given["conduction"]
    if (K.diagonal() < 0.0).any():
        remedy = "K has a positive diagonal: call it A if it is -K"
        problems.append(Problem("K has negative entries on its diagonal", where, remedy))
        return []
    _symmetric(K, "K", where, problems)
    sums = np.asarray(K.sum(axis=1)).ravel()
    if np.abs(sums).max() <= ROUNDING * _size(K):
        return [f"K: symmetric; 1 K everywhere conducts {np.abs(sums).max():.1e} W"]
    step = _time_step(sums, np.asarray(matrices.capacity.sum(axis=1)).ravel())
    if step is not None:
        problems.append(
            Problem(
                f"K is an effective matrix of a time step, C/dt + K with dt = {step:.4g} s",
                where,
                "give K itself: subtract C/dt, or export it from a steady analysis",
            )
        )
    else:
        rows = int((np.abs(sums) > ROUNDING * _size(K)).sum())
        problems.append(
            Problem(f"1 K everywhere loses {sums.sum():.4g} W in {rows} rows of K: it holds convection", where, RECIPE)
        )
    return []


def _time_step(sums: np.ndarray, capacity: np.ndarray) -> float | None:
    """dt [s] where K 1 is C 1/dt at most nodes: where films are left in as well, they act at some."""
    known = np.abs(capacity) > 1e-6 * np.abs(capacity).max()
    rate = sums[known] / capacity[known]
    middle = float(np.median(rate))
    if middle <= 0.0 or np.mean(np.abs(rate - middle) <= ALIKE * middle) <= 0.5:
        return None
    return 1.0 / middle


def _film(name: str, film: sp.csr_matrix, where: str, problems: list[Problem]) -> list[str]:
    _symmetric(film, name, where, problems)
    sums = np.asarray(film.sum(axis=1)).ravel()
    if (film.diagonal() < 0.0).any() or film.sum() <= 0.0:
        problems.append(
            Problem(
                f"the film takes up {film.sum():.4g} W of 1 K at 1 W/(m^2*K)", where,
                "it is the integral of N N^T over its surface, positive, per unit of the coefficient",
            )
        )  # fmt: skip
    return [f"{name}: symmetric; {film.sum():.6g} m^2 at {int((np.abs(sums) > 0.0).sum())} nodes"]


def _outputs(matrices: Matrices, problems: list[Problem]) -> list[str]:
    C, where = matrices.outputs, matrices.given.get("outputs", "outputs")
    if not len(C):
        problems.append(
            Problem("no outputs: nothing is watched", where, "give Y, one row per temperature (C beside E)")
        )
    sums, sizes = C.sum(axis=1), np.abs(C).sum(axis=1)
    for i, (total, size) in enumerate(zip(sums, sizes, strict=True), 1):
        if size == 0.0 or min(abs(total), abs(total - 1.0)) > ROUNDING * size:
            problems.append(
                Problem(
                    f"row {i} of the outputs sums to {total:.4g}", where,
                    "a temperature's row sums to 1, a difference's to 0: divide it, or leave it out",
                )
            )  # fmt: skip
    differences = int((np.abs(sums) <= 0.5).sum())
    return [f"outputs: {len(C) - differences} temperatures, {differences} differences"]


def _inputs(matrices: Matrices, problems: list[Problem]) -> list[str]:
    B, where = matrices.inputs, matrices.given.get("inputs", "inputs")
    for i, column in enumerate(B.T, 1):
        if column.sum() <= ROUNDING * np.abs(column).sum():
            problems.append(
                Problem(
                    f"column {i} of the inputs brings {column.sum():.4g} W per unit", where,
                    "an input is heat, positive in sum: surroundings come with the films, not with B",
                )
            )  # fmt: skip
    return [f"inputs: {', '.join(f'{s:.4g}' for s in B.sum(axis=0))} W per unit"] if B.shape[1] else []
