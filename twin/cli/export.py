"""twin export: an artefact in another tool's format."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import click

from twin.cli.quantity import Quantity
from twin.export.formats import FORMATS


@click.command(
    epilog="Example: twin export out/five_axis.h5 --format fmu2 -o out/five_axis.fmu\n\nFormats: "
    + "; ".join(f"{name}: {f.help}" for name, f in FORMATS.items())
)
@click.argument("artefact", type=click.Path())
@click.option("--format", "name", required=True, help=", ".join(FORMATS))
@click.option("-o", "--output", required=True, type=click.Path(), help="file to write")
@click.option("--precision", type=click.Choice(["double", "single"]), default="double", show_default=True,
              help="of the numbers in C")  # fmt: skip
@click.option("--run", type=click.Path(), help="C: run folder on which the error against `twin run` is measured")
@click.option("--poses", is_flag=True, help="FMUs: the TCP errors at all poses are outputs too")
@click.option("--result", type=click.Path(), help="folder of `twin run`, for formats of results")
@click.option(
    "--time", type=Quantity("s", zero=True), help="since the start of the run, e.g. '4 h'  [default: its end]"
)
def command(
    artefact: str, name: str, output: str, precision: Literal["double", "single"], run: str | None, poses: bool,
    result: str | None, time: float | None,
) -> None:  # fmt: skip
    """Write ARTEFACT in another tool's format; docs/exports.md says what each holds and how exact it is."""
    from twin.export.options import ExportOptions
    from twin.face.export import export

    options = ExportOptions(precision, _path(run), poses, _path(result), time)
    for line in export(artefact, name, output, options):
        click.echo(line)


def _path(text: str | None) -> Path | None:
    return None if text is None else Path(text)
