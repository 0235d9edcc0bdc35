"""pyMOR on the same matrices: build and step times beside ours.

That transfer functions agree is a test: tests/build/test_against_pymor.py.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from twin.build.body_matrix import system_matrix
from twin.build.project import project
from twin.build.rich_basis import RichOptions, rich_basis, sample_points
from twin.build.scenario import theta_bounds
from twin.rom.load_model import LoadModel
from twin.rom.model import AffineBody


@dataclass(frozen=True)
class Beside:
    """Ours, then pyMOR's [s]; one implicit Euler step with its factorisation."""

    states: int
    build: tuple[float, float]
    pymor_states: int
    step: tuple[float, float]


def clock(function: Callable[[], object], repeat: int = 1) -> tuple[float, object]:
    began = time.perf_counter()
    for _ in range(repeat):
        result = function()
    return (time.perf_counter() - began) / repeat, result


def beside_pymor(body: AffineBody, load: LoadModel, options: RichOptions = RichOptions()) -> Beside:
    """Project a sparse body on its rich basis with both, and let pyMOR make a basis from the same samples."""
    from pymor.algorithms.gram_schmidt import gram_schmidt
    from pymor.models.iosys import LTIModel
    from pymor.operators.numpy import NumpyMatrixOperator
    from pymor.reductors.basic import LTIPGReductor

    low, high = theta_bounds(load)
    ours_build, V = clock(lambda: rich_basis(body, low, high, options))
    theta = np.sqrt(low * high)
    inputs = np.column_stack([body.B, body.M, body.P])
    lti = LTIModel.from_matrices(-system_matrix(body, theta, 0.0).tocsc(), inputs, body.C, E=body.E.tocsc())
    space = lti.A.source

    def their_basis() -> object:
        columns = np.column_stack([inputs, body.C.T])
        basis = space.empty()
        for s, point in sample_points(body, low, high, options):
            shifted = NumpyMatrixOperator(system_matrix(body, point, s).tocsc())
            basis.append(shifted.apply_inverse(shifted.range.from_numpy(columns)))
        return gram_schmidt(basis, product=lti.E, rtol=options.tolerance, check=False)

    theirs_build, theirs = clock(their_basis)
    basis = space.from_numpy(V)
    reduced = LTIPGReductor(lti, basis, basis).reduce()
    small = project(body, V)
    A = -system_matrix(small, theta, 0.0)
    B = np.column_stack([small.B, small.M, small.P])
    dt, x = 60.0, np.zeros(small.n)
    ours_step, _ = clock(lambda: np.linalg.solve(small.E - dt * A, small.E @ x + dt * B[:, 0]), 20)
    u = reduced.B.as_range_array()[0]
    implicit = reduced.E - reduced.A * dt
    theirs_step, _ = clock(lambda: implicit.apply_inverse(reduced.E.apply(u) + u * dt), 20)
    return Beside(small.n, (ours_build, theirs_build), len(theirs), (ours_step, theirs_step))


def main() -> None:
    try:
        from pymor.core.logger import set_log_levels
    except ImportError:
        print("   not measured: pyMOR is not installed (pip install 'twin[compare]')")
        return
    from benchmarks.five_axis import full

    set_log_levels({"pymor": "ERROR"})
    model = full().thermal
    body = next(b for b in model.bodies if b.name == "headstock")
    r = beside_pymor(body, model.load_model)
    print(f"   {body.name}, {body.n} unknowns, {r.states} rich states")
    print(f"   basis: ours with TCP adjoints {r.build[0]:.1f} s; pyMOR, the same samples without them, "
          f"{r.build[1]:.1f} s for {r.pymor_states} states")  # fmt: skip
    print(f"   implicit Euler step with factorisation: ours (NumPy) {1e3 * r.step[0]:.2f} ms, "
          f"pyMOR {1e3 * r.step[1]:.2f} ms")  # fmt: skip
