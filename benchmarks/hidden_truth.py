"""One run after the other of another five-axis machine, by the full model: nodes and seconds. Needs gmsh, once."""

from __future__ import annotations

import resource
import time

import numpy as np

from benchmarks.five_axis import EXPERIMENT
from twin.build.full_model import assemble
from twin.build.simulate import simulate
from twin.inject.experiment import RUNS, START, SUBSTEPS
from twin.inject.truth.other_machine import other_machine, other_text
from twin.inject.truth.side_by_side import driven


def main() -> None:
    began = time.perf_counter()
    full = assemble(other_machine(EXPERIMENT, other_text(EXPERIMENT, 0)))
    nodes = sum(body.n for body in full.thermal.bodies)
    print(f"   {nodes} nodes in {len(full.thermal.bodies)} bodies, assembled in {time.perf_counter() - began:.0f} s")
    for run in RUNS:
        began = time.perf_counter()
        one = driven(full, EXPERIMENT.run(run), {})
        made = simulate(full, one.drive, one.when, one.where, START, SUBSTEPS)
        seconds = time.perf_counter() - began
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
        rise, tcp = np.abs(made.temperatures - START).max(axis=0), 1e6 * np.abs(made.tcp).max(axis=0)
        warmest = made.sensors[int(rise.argmax())]
        print(
            f"   {run}: {made.time[-1] / 3600:.0f} h in {seconds:.0f} s, {memory:.1f} GiB; largest rise"
            f" {rise.max():.1f} K ({warmest}), TCP {tcp[0]:.0f} / {tcp[1]:.0f} / {tcp[2]:.0f} um",
            flush=True,
        )


if __name__ == "__main__":
    main()
