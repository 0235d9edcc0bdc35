"""twin run: replay a run folder on an artefact."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from twin.cli.bundle import bundled
from twin.cli.quantity import Quantity

if TYPE_CHECKING:
    from twin.face.run import Checkpoints


def _checkpoints() -> type[Any]:
    from twin.face.run import Checkpoints

    return Checkpoints


@click.command(epilog="Example: twin run out/five_axis.h5 models/five_axis/runs/experiment_a -o out/run --dt '60 s'")
@click.argument("artefact", type=click.Path())
@click.argument("run", type=click.Path())
@click.option("-o", "--output", required=True, type=click.Path(), help="folder for the results")
@click.option("--dt", default="60 s", show_default=True, type=Quantity("s"), help="time step")
@click.option("--substeps", type=click.IntRange(1), help="substeps of the integrator; default: as the certificate says")
@click.option("--initial", help="temperature at the start, e.g. '20 degC', or a result.h5 to go on from  "
              "[default: the run's own, else of the air around it]")  # fmt: skip
@click.option("--checkpoint", default=1440, show_default=True, type=click.IntRange(1), help="steps between checkpoints")
@click.option("--resume", is_flag=True, help="go on after an interruption, with exactly the same numbers")
@bundled(_checkpoints)
def command(
    artefact: str, run: str, output: str, dt: float, substeps: int | None, initial: str | None, options: Checkpoints
) -> None:
    """Step the model of ARTEFACT through the loads of RUN.

    Writes result.h5 (everything), temperatures.csv and tcp.csv (as in a run folder) and summary.json to OUTPUT.
    """
    from twin.face.run import run as step
    from twin.progress import bar

    result = step(artefact, run, output, dt=dt, substeps=substeps, initial=initial, checkpoints=options, progress=bar)
    click.echo(f"{output}: {result}")
