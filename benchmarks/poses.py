"""TCP rows: flexibility against a direct solve of the whole machine, and artefacts at random positions."""

from __future__ import annotations

import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks import five_axis
from benchmarks.five_axis import full, machine
from twin.build.coupled_direct import assemble_coupled
from twin.build.pipeline import VERIFY_SEED, BuildOptions, compact_model, full_model, rich_model
from twin.build.pose_study import fields_of_run
from twin.build.scenario import draw
from twin.build.stepper import CoupledStepper, tcp_at_poses
from twin.logs.read import read_run
from twin.machine.load import load_machine
from twin.progress import bar
from twin.rom.artefact import read_artefact, write_artefact
from twin.rom.poses import pose_weights
from twin.rom.tcp import tcp_over, tcp_rows

MODELS = Path(__file__).parents[1] / "models"
RUNS = 2  # of each machine, the first ones


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
    for folder in (MODELS / "ram_borer", MODELS / "five_axis"):
        at_random_positions(folder)


def at_random_positions(folder: Path) -> None:
    """An artefact against the full model, both under the loads of the machine's runs: exact rows and interpolated ones.

    What exact rows leave is the reduction's error, as it is at the poses of the grid.
    """
    machine = load_machine(folder / "machine.toml")
    whole = five_axis.full() if folder == five_axis.FOLDER else full_model(machine, bar)
    options = BuildOptions()
    compact = compact_model(machine, rich_model(machine, whole, options.rich, bar), options, bar)
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "A.h5"
        write_artefact(path, replace(compact, bodies=tuple(replace(b, F=None) for b in compact.bodies)))
        size, model = path.stat().st_size, read_artefact(path).model
    grid = model.pose_grid
    low, high = np.array([g[0] for g in grid]), np.array([g[-1] for g in grid])
    random = np.random.default_rng(0).uniform(low, high, (200, len(grid)))
    errors: dict[str, list[np.ndarray]] = {"exact": [], "interpolated": [], "at the poses": []}
    largest = 0.0
    for name in sorted(p.parent for p in folder.glob("runs/*/run.toml"))[:RUNS]:
        run = read_run(name)
        times = [float(run.loads.time[-1] - run.loads.time[0]) * k / 4 for k in range(1, 5)]
        truth, ours = (
            [np.array(b) for b in zip(*fields_of_run(replace(whole, thermal=m), run, times)[1], strict=True)]
            for m in (whole.thermal, model)
        )
        wanted = tcp_over(whole.thermal, truth, random)
        largest = max(largest, float(np.abs(wanted).max()))
        errors["exact"].append(tcp_over(model, ours, random) - wanted)
        errors["interpolated"].append(tcp_over(replace(model, structure=None), ours, random) - wanted)
        errors["at the poses"].append(tcp_over(model, ours, model.poses) - tcp_over(whole.thermal, truth, model.poses))
    told = "; ".join(
        f"{kind} {1e6 * np.sqrt(np.mean(np.square(e))):.3f} um rms, {1e6 * np.abs(e).max():.3f} at most"
        for kind, e in errors.items()
    )
    began = time.perf_counter()
    tcp_rows(model, np.random.default_rng(1).uniform(low, high, (720, len(grid))))
    print(
        f"   {folder.name}, artefact of {model.n} states and {size / 2**20:.1f} MiB against the full model at 200 "
        f"random positions, {RUNS} runs, TCP errors up to {1e6 * largest:.0f} um: {told}; rows of 720 positions in "
        f"{time.perf_counter() - began:.2f} s"
    )
