"""One runtime step with 125 poses beside the full model's step and 125 pose solves with stored factors.

In processor time, which other work on the machine changes little; a step has one thread.
"""

from __future__ import annotations

import twin.run.jax_setup  # noqa: F401  isort: skip  before numpy: JAX's LAPACK is SciPy's OpenBLAS

import time
from collections.abc import Callable
from dataclasses import replace

import jax
import numpy as np

from benchmarks.five_axis import FOLDER, compact, full, machine
from benchmarks.laws import constant
from twin.build.coupled_direct import assemble_coupled
from twin.build.factorize import factorize
from twin.build.pipeline import VERIFY_SEED
from twin.build.scenario import draw
from twin.build.stepper import CoupledStepper
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.rom.drive import evaluate
from twin.rom.model import MachineModel
from twin.rom.tableau import IMPLICIT_EULER, SDIRK2_6, Tableau
from twin.run.stepping import advance, inputs_of, observe
from twin.run.system import prepare

STEPS = 64
SUBSTEPS = 1  # with which `twin build` certifies the machine
EULER_STEPS = 4  # of implicit Euler in a minute: how steps were made before they were of second order
REPEAT = 25


def median(function: Callable[[], object], repeat: int, clock: Callable[[], float] = time.process_time) -> float:
    times = []
    for _ in range(repeat):
        began = clock()
        function()
        times.append(clock() - began)
    return float(np.median(times))


def milliseconds(
    model: MachineModel, still: bool, clock: Callable[[], float] = time.process_time
) -> tuple[float, float]:
    """Of a step with all outputs, and of one by EULER_STEPS of implicit Euler: medians of turns one after the other.

    still: every axis rests, so that the factor is kept while films allow.
    """
    run = read_run(FOLDER / "runs" / "experiment_a")
    signals = signal_values(run, model.load_model.signals)
    if still:
        signals = {name: np.full_like(values, values[0]) for name, values in signals.items()}
    drive = evaluate(model.load_model, run.loads.time, signals, 60.0, STEPS)
    reduced = prepare(model)
    start = reduced.uniform(24.0)

    def steps(tableau: Tableau, substeps: int) -> Callable[[], object]:
        inputs = inputs_of(model.load_model, drive, substeps, tableau=tableau)
        if not still:
            inputs = replace(inputs, changed=np.ones(STEPS, dtype=bool))

        def go() -> object:
            states, heat = advance(reduced.layout, reduced.system, start, inputs)
            return jax.block_until_ready((observe(reduced.system, states), heat))

        go()  # compile
        return go

    both = steps(SDIRK2_6, SUBSTEPS), steps(IMPLICIT_EULER, EULER_STEPS)
    times = np.array(
        [[median(go, 1, clock) for go in both] for _ in range(REPEAT)]
    )  # by turns: both see the same machine
    now, before = 1e3 * np.median(times, axis=0) / STEPS
    return float(now), float(before)


def main() -> None:
    model = compact()
    plain = replace(model, load_model=constant(model.load_model))
    timed = [milliseconds(plain, True), milliseconds(model, True), milliseconds(model, False)]
    frozen, following, moving = (now for now, _ in timed)
    print(f"   runtime, {model.n} states, {SUBSTEPS} substeps, {len(model.poses)} poses, processor time: "
          f"{frozen:.3f} ms with a kept factor and constant films, {following:.3f} ms with films that follow, "
          f"{moving:.3f} ms with a new factor")  # fmt: skip
    print(f"   beside {EULER_STEPS} steps of implicit Euler, by turns: "
          + ", ".join(f"{now / before - 1.0:+.0%} ({before:.3f} ms)" for now, before in timed))  # fmt: skip

    stepper = CoupledStepper(full().thermal)
    x = stepper.uniform(20.0)
    drive = draw(model.load_model, VERIFY_SEED + 1, STEPS / 60, 60.0).drive
    steps = stepper.run(drive, x, SUBSTEPS)
    next(steps)  # factorises
    thermal = median(lambda: next(steps), 7)
    coupled = assemble_coupled(machine(), full().bodies)
    position = np.array([g[1] for g in full().thermal.pose_grid])
    factor = factorize(coupled.stiffness(position))
    rhs = coupled.KT @ np.concatenate([np.ones(b.n) for b in full().thermal.bodies])
    pose = median(lambda: factor.solve(rhs), 7)
    poses = len(model.poses)
    whole = thermal + poses * pose
    print(f"   full model, {full().thermal.n} thermal and {coupled.K.shape[0]} elastic unknowns: "
          f"{thermal:.3f} s per step + {poses} x {pose:.3f} s = {whole:.1f} s with stored factors")  # fmt: skip
    print(f"   ratio: {1e3 * whole / frozen:,.0f} kept factor, {1e3 * whole / following:,.0f} following films, "
          f"{1e3 * whole / moving:,.0f} new factor in every step")  # fmt: skip
