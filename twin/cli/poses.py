"""twin poses: which grid of poses suffices, and how much of the volumetric error is a shift."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from twin.cli.bundle import bundled
from twin.cli.quantity import Quantity

if TYPE_CHECKING:
    from twin.build.pose_study import GridError
    from twin.face.poses import PoseOptions, Poses


def _options() -> type[Any]:
    from twin.face.poses import PoseOptions

    return PoseOptions


@click.command(epilog="Example: twin poses models/five_axis models/five_axis/runs/experiment_a --at '4 h' --at '12 h'")
@click.argument("machine", type=click.Path())
@click.argument("run", type=click.Path())
@click.option(
    "--tolerance", default="1 um", show_default=True, type=Quantity("m"), help="interpolation error allowed at any pose"
)
@click.option(
    "--at",
    "at",
    multiple=True,
    type=Quantity("s"),
    help="time in the run, e.g. '4 h'; repeat it; six equal parts by default",
)
@click.option("--random", default=200, show_default=True, type=click.IntRange(1), help="random poses")
@click.option("--most", default=7, show_default=True, type=click.IntRange(2, 13), help="most positions per axis")
@click.option(
    "--steps", default=72, show_default=True, type=click.IntRange(1), help="steps of the full model over the run"
)
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0), help="seed of the random poses")
@click.option("--json", "as_json", is_flag=True, help="machine-readable")
@bundled(_options)
def command(machine: str, run: str, as_json: bool, options: PoseOptions) -> int:
    """Which pose grid of MACHINE suffices for the loads of RUN, measured at random poses.

    Steps the full model through the run, takes its temperatures at some times as load cases, and compares interpolation
    between equidistant poses with the structure itself. Exit status 1 if no grid keeps the tolerance.
    """
    import json

    from twin.face.poses import poses
    from twin.progress import bar, silent

    found = poses(machine, run, options, silent if as_json else bar)
    click.echo(json.dumps(found.facts(), indent=2) if as_json else "\n".join(lines(found)))
    return 0 if found.suffices else 1


def lines(found: Poses) -> list[str]:
    """The study for a reader: um and h."""
    study, tolerance = found.study, found.tolerance
    told = ["volumetric error, 5 positions per axis", "      time   max TCP error   shift   linear   higher order"]
    for t, size, s in zip(found.times, found.sizes, found.shares, strict=True):
        parts = "       -        -              -"
        if size > 0.0:
            parts = f"{s.shift:7.1%} {s.linear:8.1%} {s.higher:14.1%}"
        told.append(f"  {t / 3600:6.2f} h {1e6 * size:11.1f} um {parts}")
    told += [
        "",
        f"interpolation error at {found.random} random poses, all load cases; "
        f"TCP errors up to {1e6 * study.case:.1f} um",
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
