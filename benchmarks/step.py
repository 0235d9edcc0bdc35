"""One runtime step with 125 poses beside the full model's step and 125 pose solves with stored factors."""

from __future__ import annotations

import twin.run.jax_setup  # noqa: F401  isort: skip  before numpy: JAX's LAPACK is SciPy's OpenBLAS

import time
from collections.abc import Callable
from dataclasses import replace

import jax
import numpy as np

from benchmarks.five_axis import compact, full, machine
from twin.build.coupled_direct import assemble_coupled
from twin.build.factorize import factorize
from twin.build.pipeline import VERIFY_SEED
from twin.build.scenario import draw
from twin.build.stepper import CoupledStepper
from twin.rom.drive import Drive
from twin.run.stepping import advance, inputs_of, observe
from twin.run.system import prepare

STEPS = 64


def median(function: Callable[[], object], repeat: int) -> float:
    times = []
    for _ in range(repeat):
        began = time.perf_counter()
        function()
        times.append(time.perf_counter() - began)
    return float(np.median(times))


def main() -> None:
    load = compact().load_model
    drive = draw(load, VERIFY_SEED + 1, STEPS / 60, 60.0).drive
    reduced = prepare(compact())
    inputs = inputs_of(load, drive, 4)
    start = reduced.uniform(20.0)

    def run(changed: bool) -> Callable[[], object]:
        marked = np.full(STEPS, changed)
        marked[0] = True  # the first step needs a factor in any case
        each = replace(inputs, changed=marked)

        def go() -> object:
            states, heat = advance(reduced.layout, reduced.system, start, each)
            return jax.block_until_ready((observe(reduced.system, states), heat))

        go()  # compile
        return go

    frozen, moving = (median(run(changed), 15) / STEPS for changed in (False, True))
    print(f"   runtime, {compact().n} states, 4 substeps, {len(compact().poses)} poses: "
          f"{1e3 * moving:.3f} ms with refactorisation, {1e3 * frozen:.3f} ms with a frozen factor")  # fmt: skip

    stepper = CoupledStepper(full().thermal)
    x = stepper.uniform(20.0)
    steps = stepper.run(constant_films(drive), x, 4)
    next(steps)  # factorises
    thermal = median(lambda: next(steps), 7)
    coupled = assemble_coupled(machine(), full().bodies)
    position = np.array([g[1] for g in full().thermal.pose_grid])
    factor = factorize(coupled.stiffness(position))
    rhs = coupled.KT @ np.concatenate([np.ones(b.n) for b in full().thermal.bodies])
    pose = median(lambda: factor.solve(rhs), 7)
    poses = len(compact().poses)
    whole = thermal + poses * pose
    print(f"   full model, {full().thermal.n} thermal and {coupled.K.shape[0]} elastic unknowns: "
          f"{thermal:.3f} s per step + {poses} x {pose:.3f} s = {whole:.1f} s with stored factors")  # fmt: skip
    print(f"   ratio: {whole / frozen:,.0f} frozen, {whole / moving:,.0f} with refactorisation in every step")


def constant_films(drive: Drive) -> Drive:
    """The same loads with the films of the first step, so that the full model keeps its factors."""
    return replace(drive, theta=np.broadcast_to(drive.theta[0], drive.theta.shape).copy())
