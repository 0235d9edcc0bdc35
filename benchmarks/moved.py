"""A compact model trained at one pose and then moved, beside ours, on the same held-out scenarios."""

from __future__ import annotations

import numpy as np

from benchmarks.five_axis import compact, machine, rich
from twin.build.comparison import compare
from twin.build.compress import Tolerances, galerkin, trajectories
from twin.build.pipeline import VERIFY_SEED, BuildOptions, training_scenarios
from twin.build.scenario import draw


def main() -> None:
    options = BuildOptions()
    unit = Tolerances(machine().limits.temperature, machine().limits.displacement)
    load = rich().load_model
    still = training_scenarios(load, options, still=True)
    one_pose = galerkin(rich(), trajectories(rich(), still), options.states, unit)
    moving = [draw(load, VERIFY_SEED + i, options.hours, options.step) for i in range(6)]
    for label, model in (("trained at one pose", one_pose), ("ours", compact())):
        result = compare(rich(), model, moving)
        T, u = result.temperature_error.max(), result.displacement_error.max()
        share = (result.temperature_error.max(axis=0) / result.temperature_range).max()
        print(
            f"   {label:>20}: {model.n} states, max {T:.4f} K, {1e6 * u:.3f} um, "
            f"worst sensor {100 * share:.2f} % of its range"
        )
    np.testing.assert_equal(one_pose.n, compact().n)
