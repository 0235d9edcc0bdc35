"""TCP rows: part-wise flexibility against one direct solve of the coupled machine, and interpolation between poses."""

from __future__ import annotations

import numpy as np

from benchmarks.five_axis import full, machine
from twin.build.coupled_direct import assemble_coupled
from twin.build.pipeline import VERIFY_SEED
from twin.build.scenario import draw
from twin.build.stepper import CoupledStepper, tcp_at_poses
from twin.rom.poses import pose_weights


def main() -> None:
    model, structure = full().thermal, full().structure
    rng = np.random.default_rng(0)
    low = np.array([g[0] for g in model.pose_grid])
    high = np.array([g[-1] for g in model.pose_grid])
    worst = 0.0
    coupled = assemble_coupled(machine(), full().bodies)
    for position in rng.uniform(low, high, (5, len(low))):
        direct = coupled.rows(position)
        ours = [G[0] for G in structure.pose_rows(position[None, :])]
        error = max(np.abs(a - b).max() for a, b in zip(ours, direct, strict=True))
        worst = max(worst, error / max(np.abs(b).max() for b in direct))
    print(f"   flexibility against direct solve at 5 random poses: {worst:.1e} of the largest row entry")

    fields = []
    for seed in range(
        3
    ):  # fields as loads make them: steady states of held-out scenarios, the largest errors there are
        scenario = draw(model.load_model, VERIFY_SEED + seed, 1.0, 60.0)
        fields.append(CoupledStepper(model).steady_state(scenario.drive, scenario.drive.n_steps // 2))
    positions = rng.uniform(low, high, (200, len(low)))
    exact = [np.array([structure.displacement(p, tuple(x)) for p in positions]) for x in fields]
    grids = [tcp_at_poses(model, x) for x in fields]
    span = max(np.abs(g).max() for g in grids)
    case = machine().limits.at_displacement_range
    for kind in ("linear", "cubic", "lagrange"):
        weights, _ = pose_weights(model.pose_grid, positions, kind)
        errors = [np.abs(weights @ g - e).max() for g, e in zip(grids, exact, strict=True)]
        scaled = max(e * case / np.abs(g).max() for e, g in zip(errors, grids, strict=True))
        print(
            f"   {kind:>8} interpolation at 200 random poses: max {1e6 * max(errors):.3f} um at TCP errors up to "
            f"{1e6 * span:.1f} um; {1e6 * scaled:.3f} um with every field scaled to {1e6 * case:.0f} um"
        )
