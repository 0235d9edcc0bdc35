"""pyMOR on the same matrices: transfer function of the rich basis, and step and build times beside ours."""

from __future__ import annotations

import time

import numpy as np

from benchmarks.five_axis import full, rich
from twin.build.rich_basis import RichOptions, rich_basis
from twin.build.scenario import theta_bounds
from twin.build.stepper import system_matrix


def main() -> None:
    try:
        from pymor.core.logger import set_log_levels
        from pymor.models.iosys import LTIModel
        from pymor.reductors.basic import LTIPGReductor
    except ImportError:
        print("   not measured: pyMOR is not installed (pip install 'twin[compare]')")
        return
    set_log_levels({"pymor": "ERROR"})
    model = full().thermal
    low, high = theta_bounds(model.load_model)
    body = min(model.bodies, key=lambda b: b.n)
    began = time.perf_counter()
    V = rich_basis(body, low, high, RichOptions())
    ours_build = time.perf_counter() - began
    theta = np.sqrt(low * high)
    A = -system_matrix(body, theta, 0.0).tocsc()
    inputs = np.column_stack([body.B, body.M, body.P])
    lti = LTIModel.from_matrices(A, inputs, body.C, E=body.E.tocsc())
    basis = lti.solution_space.from_numpy(V) if hasattr(lti, "solution_space") else lti.A.source.from_numpy(V)
    began = time.perf_counter()
    reduced = LTIPGReductor(lti, basis, basis).reduce()
    theirs_build = time.perf_counter() - began
    ours = next(b for b in rich().bodies if b.name == body.name)
    worst = 0.0
    for s in (1e-6j, 1e-4j, 1e-2j):
        mine = V.T @ inputs
        H = (body.C @ V) @ np.linalg.solve(s * (V.T @ (body.E @ V)) - V.T @ (A @ V), mine)
        worst = max(worst, np.abs(H - reduced.transfer_function.eval_tf(s)).max() / np.abs(H).max())
    print(f"   {body.name}: {V.shape[1]} rich states; our projection and pyMOR's agree to {worst:.1e}; "
          f"cached rich model has {ours.n}; basis {ours_build:.1f} s, "
          f"pyMOR's projection alone {theirs_build:.1f} s")  # fmt: skip
    dt, r = 60.0, V.shape[1]
    E, K = V.T @ (body.E @ V), -(V.T @ (A @ V))
    x = np.zeros(r)
    began = time.perf_counter()
    for _ in range(20):
        x = np.linalg.solve(E + dt * K, E @ x + dt * mine[:, 0])
    ours_step = (time.perf_counter() - began) / 20
    op, mass = reduced.A, reduced.E
    u = reduced.B.as_range_array()[0]
    state = u * 0.0
    implicit = mass - op * dt
    began = time.perf_counter()
    for _ in range(20):
        state = implicit.apply_inverse(mass.apply(state) + u * dt)
    theirs_step = (time.perf_counter() - began) / 20
    print(
        f"   implicit Euler step at {r} states, refactorised: ours {1e3 * ours_step:.2f} ms, "
        f"pyMOR {1e3 * theirs_step:.2f} ms"
    )
