"""twin simulate: step the full model through a run and write a run folder like a measured one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from twin.cli.bundle import bundled
from twin.cli.quantity import Quantity

if TYPE_CHECKING:
    from twin.face.simulate import SimulateOptions


def _options() -> type[Any]:
    from twin.face.simulate import SimulateOptions

    return SimulateOptions


@click.command(
    epilog="Example: twin simulate models/five_axis/machine.toml models/five_axis/runs/experiment_a -o out/truth "
    "--noise '0.08 K' --tcp-noise '1 um' --hours 1"
)
@click.argument("machine", type=click.Path())
@click.argument("run", type=click.Path())
@click.option("-o", "--output", required=True, type=click.Path(), help="run folder to write")
@click.option("--size", type=Quantity("m"),
              help="mesh size for new meshes by the model's geometry.py, e.g. '80 mm' "
              "(needs the mesh extra)")  # fmt: skip
@click.option("--dt", default="60 s", show_default=True, type=Quantity("s"), help="time step")
@click.option(
    "--substeps", default=1, show_default=True, type=click.IntRange(1), help="time integrator's steps per step"
)
@click.option("--hours", type=click.FloatRange(0, min_open=True), help="stop after this time; the whole run by default")
@click.option("--tcp-every", default="30 min", show_default=True, type=Quantity("s"),
              help="TCP rows, where the run has no tcp.csv")  # fmt: skip
@click.option("--noise", default="0 K", show_default=True, type=Quantity("delta_degC", zero=True),
              help="standard deviation at sensors")  # fmt: skip
@click.option("--tcp-noise", default="0 um", show_default=True, type=Quantity("m", zero=True),
              help="standard deviation of TCP rows")  # fmt: skip
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0), help="seed of the noise")
@bundled(_options)
def command(machine: str, run: str, output: str, options: SimulateOptions) -> None:
    """Step the full model of MACHINE through the loads of RUN; writes temperatures and TCP rows to OUTPUT."""
    from twin.face.simulate import simulation
    from twin.progress import bar

    click.echo(f"{output}: {simulation(machine, run, output, options, bar)}")
