"""Full-model truths of the trials in tests/hidden, written where tests find them.

    python -m benchmarks.hidden_store                  # those that are missing, the most important first
    python -m benchmarks.hidden_store zone coolant     # these, anew
    python -m benchmarks.hidden_store --error 120      # what the time step changes in the first 120 min

Needs gmsh, once; some 2 min a trial. Each is stored as soon as it is done (`twin.inject.stored`).
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from benchmarks.five_axis import EXPERIMENT, TRUTHS
from twin.build.full_model import assemble
from twin.build.simulate import simulate
from twin.inject.experiment import RUNS, START, STEP
from twin.inject.stored.files import write
from twin.inject.stored.full import made, together
from twin.inject.stored.recipe import about
from twin.inject.stored.table import simulated
from twin.inject.truth.other_machine import other_machine, other_text
from twin.inject.truth.side_by_side import driven, truths_of
from twin.logs.signals import signal_values
from twin.rom.drive import evaluate


def print_error(steps: int) -> None:
    """Against Euler steps of `twin simulate`: four to the minute, and sixteen, which are next to exact."""
    full = assemble(other_machine(EXPERIMENT, other_text(EXPERIMENT, 0)))
    several = [driven(full, EXPERIMENT.run(run), {}) for run in RUNS]
    began = time.process_time()
    (side,) = truths_of([full], several, steps)
    print(f"   {len(RUNS)} runs of {steps} min side by side in {time.process_time() - began:.0f} s")
    for truth, one in zip(side[:2], several[:2], strict=True):
        run = EXPERIMENT.run(one.name)
        load = full.thermal.load_model
        drive = evaluate(load, run.loads.time, signal_values(run, load.signals), STEP, steps)
        rows = one.when <= drive.time[-1]
        euler = {n: simulate(full, drive, one.when[rows], one.where[rows], START, n) for n in (4, 16)}
        for name, T, tcp in (
            ("side by side", truth.temperatures, truth.tcp[rows]),
            ("4 Euler steps", euler[4].temperatures, euler[4].tcp),
        ):
            error = T - euler[16].temperatures
            most, mean = np.abs(error).max(axis=0), np.sqrt((error**2).mean(axis=0))
            worst = np.argsort(most)[:-4:-1]
            told = ", ".join(f"{truth.sensors[j]} {most[j]:.3f} (rms {mean[j]:.3f})" for j in worst)
            um = 1e6 * np.abs(tcp - euler[16].tcp).max()
            print(f"   {one.name}, {name} against 16: K at most {told}; TCP {um:.2f} um", flush=True)


def main() -> None:
    names = simulated(EXPERIMENT)
    parser = argparse.ArgumentParser(prog="python -m benchmarks.hidden_store", description=__doc__)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(names)}")
    parser.add_argument("--error", type=int, metavar="MINUTES", help="print what the time step changes in these")
    asked = parser.parse_args()
    if asked.error:
        print_error(asked.error)
        return
    for name in asked.names or names:
        if not asked.names and (TRUTHS / f"{name}.npz").exists():
            continue
        began = time.perf_counter()
        recipes = together(EXPERIMENT, name)
        for recipe, truths in zip(recipes, made(EXPERIMENT, recipes), strict=True):
            path = TRUTHS / recipe.file
            write(path, truths, about(recipe))
            seconds, size = time.perf_counter() - began, path.stat().st_size
            print(f"   {recipe.name}: {seconds:.0f} s, {size / 1e3:.0f} kB", flush=True)


if __name__ == "__main__":
    main()
