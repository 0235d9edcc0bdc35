"""twin export: an artefact in another tool's format."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from twin.cli.bundle import bundled
from twin.cli.quantity import Quantity
from twin.export.formats import FORMATS

if TYPE_CHECKING:
    from twin.export.options import ExportOptions


def _options() -> type[Any]:
    from twin.export.options import ExportOptions

    return ExportOptions


@click.command(epilog="Example: twin export out/five_axis.h5 --format fmu2 -o out/five_axis.fmu")
@click.argument("artefact", type=click.Path())
@click.option("--format", "name", required=True, help="; ".join(f"{k}: {f.help}" for k, f in FORMATS.items()))
@click.option("-o", "--output", required=True, type=click.Path(), help="file to write; heidenhain, vtk: folder")
@click.option("--precision", type=click.Choice(["double", "single"]), default="double", show_default=True,
              help="precision of the numbers in C")  # fmt: skip
@click.option("--run", type=click.Path(path_type=Path),
              help="C: run folder on which the error against `twin run` is measured")  # fmt: skip
@click.option("--poses", is_flag=True, help="FMUs: the TCP errors at all poses are outputs too")
@click.option("--result", type=click.Path(path_type=Path), help="folder of `twin run`, for formats of results")
@click.option(
    "--time", type=Quantity("s", zero=True), help="since the start of the run, e.g. '4 h'  [default: its end]"
)
@click.option("--at", help="axis positions of a state space, e.g. 'x=100 mm, y=0 mm'  [default: the result's, or zero]")
@click.option("--frames", type=click.IntRange(2), default=60, show_default=True,
              help="ParaView: times of the run, evenly spaced")  # fmt: skip
@click.option("--field", is_flag=True, help="ParaView: the volume by the full model")
@bundled(_options)
def command(artefact: str, name: str, output: str, options: ExportOptions) -> None:
    """Write ARTEFACT in another tool's format; docs/exports.md says what each holds and how exact it is."""
    from twin.face.export import export

    for line in export(artefact, name, output, options):
        click.echo(line)
