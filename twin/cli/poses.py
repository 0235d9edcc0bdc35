"""twin poses: which grid of poses suffices, and how much of the volumetric error is a shift."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from twin.build.pose_study import GridError, PoseStudy
    from twin.build.volumetric import Shares


@click.command(epilog="Example: twin poses models/five_axis models/five_axis/runs/experiment_a --at '4 h' --at '12 h'")
@click.argument("machine", type=click.Path())
@click.argument("run", type=click.Path())
@click.option("--tolerance", default="1 um", show_default=True, help="interpolation error allowed at any pose")
@click.option("--at", "at", multiple=True, help="time in the run, e.g. '4 h'; repeat it; six equal parts by default")
@click.option("--random", "count", default=200, show_default=True, type=click.IntRange(1), help="random poses")
@click.option("--most", default=7, show_default=True, type=click.IntRange(2, 13), help="most positions per axis")
@click.option("--steps", default=72, show_default=True, type=click.IntRange(1), help="of the full model over the run")
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0), help="of the random poses")
@click.option("--json", "as_json", is_flag=True, help="machine-readable")
def command(
    machine: str, run: str, tolerance: str, at: tuple[str, ...], count: int, most: int, steps: int, seed: int,
    as_json: bool,
) -> int:  # fmt: skip
    """Which pose grid of MACHINE suffices for the loads of RUN, measured at random poses.

    Steps the full model through the run, takes its temperatures at some times as load cases, and compares interpolation
    between equidistant poses with the structure itself. Exit status 1 if no grid keeps the tolerance.
    """
    import json
    from pathlib import Path

    import numpy as np

    from twin.build.pipeline import full_model
    from twin.build.pose_study import fields_of_run, study_grids
    from twin.build.volumetric import displacements, grid_points, volumetric_shares
    from twin.cli.quantity import positive
    from twin.cli.sound import require_sound
    from twin.errors import DescriptionError
    from twin.logs.read import read_run
    from twin.machine.load import load_machine
    from twin.progress import bar, silent

    allowed = positive("--tolerance", tolerance, "m")
    asked = [positive("--at", text, "s") for text in at]
    progress = silent if as_json else bar
    require_sound(Path(machine))
    described = load_machine(Path(machine))
    log = read_run(Path(run))
    span = float(log.loads.time[-1] - log.loads.time[0])
    full = full_model(described, progress)
    structure = full.structure
    strokes = [described.axes[a].stroke for a in structure.axes]
    if not strokes:
        raise DescriptionError("has no linear axis, so there is one pose only", machine, "nothing to be found out here")
    times, fields = fields_of_run(full, log, asked or [span * k / 6 for k in range(1, 7)], steps, progress)
    even = grid_points([np.linspace(low, high, 5) for low, high in strokes])
    errors = displacements(structure, even, fields)
    shares = [volumetric_shares(even, error) for error in errors]
    sizes = [float(np.abs(error).max()) for error in errors]
    study = study_grids(structure.axes, strokes, lambda p: displacements(structure, p, fields), count, most, seed)
    told = facts(study, allowed, count, times, sizes, shares)
    click.echo(json.dumps(told, indent=2) if as_json else "\n".join(lines(study, allowed, count, times, sizes, shares)))
    return 0 if any(study.smallest(allowed, kind) for kind in ("linear", "lagrange")) else 1


def facts(
    study: PoseStudy, tolerance: float, count: int, times: list[float], sizes: list[float], shares: list[Shares]
) -> dict[str, Any]:
    """Everything `twin poses` tells, as JSON values (SI)."""

    def row(g: GridError | None) -> dict[str, Any] | None:
        if g is None:
            return None
        return {"counts": list(g.counts), "poses": g.poses, "max_m": dict(g.maximum), "p95_m": dict(g.p95)}

    return {
        "axes": list(study.axes),
        "random_poses": count,
        "tolerance_m": tolerance,
        "case_m": study.case,
        "load_cases": [
            {
                "time_s": t,
                "max_tcp_error_m": size,
                "shares": None if size == 0.0 else {"shift": s.shift, "linear": s.linear, "higher": s.higher},
            }
            for t, size, s in zip(times, sizes, shares, strict=True)
        ],
        "grids": [row(g) for g in study.grids],
        "smallest": {
            kind: {
                "equal": row(study.smallest(tolerance, kind, equal=True)),
                "any": row(study.smallest(tolerance, kind)),
            }
            for kind in ("linear", "lagrange")
        },
    }


def lines(
    study: PoseStudy, tolerance: float, count: int, times: list[float], sizes: list[float], shares: list[Shares]
) -> list[str]:
    """The same for a reader: um and h."""
    told = ["volumetric error, 5 positions per axis", "      time   max TCP error   shift   linear   higher order"]
    for t, size, s in zip(times, sizes, shares, strict=True):
        parts = "       -        -              -"
        if size > 0.0:
            parts = f"{s.shift:7.1%} {s.linear:8.1%} {s.higher:14.1%}"
        told.append(f"  {t / 3600:6.2f} h {1e6 * size:11.1f} um {parts}")
    told += [
        "",
        f"interpolation error at {count} random poses, all load cases; TCP errors up to {1e6 * study.case:.1f} um",
        f"  {' x '.join(study.axes):>12}   poses   linear max   95 %   polynomial max   95 %  (um)",
    ]
    for g in study.equal:
        a, b = (f"{1e6 * g.maximum[k]:11.2f} {1e6 * g.p95[k]:6.2f}" for k in ("linear", "lagrange"))
        told.append(f"  {_counts(g):>12} {g.poses:7d}  {a}      {b}")
    told.append("")
    for kind, name in (("lagrange", "polynomial"), ("linear", "linear")):
        equal, best = study.smallest(tolerance, kind, equal=True), study.smallest(tolerance, kind)  # type: ignore[arg-type]
        text = f"{name} interpolation within {1e6 * tolerance:g} um: "
        if equal is None and best is None:
            told.append(text + "no grid of those tried; ask for --most more positions, or a larger --tolerance")
            continue
        text += "no equal grid" if equal is None else f"{_counts(equal)} = {equal.poses} poses"
        if best is not None and best != equal:
            text += f"; fewest: {_counts(best)} = {best.poses} poses ({', '.join(study.axes)})"
        told.append(text)
    return told


def _counts(g: GridError) -> str:
    return " x ".join(str(n) for n in g.counts)
