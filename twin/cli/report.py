"""twin report: pictures of a result."""

from __future__ import annotations

import click


@click.command(epilog="Example: twin report out/five_axis.h5 out/experiment_a")
@click.argument("artefact", type=click.Path())
@click.argument("output", type=click.Path())
def command(artefact: str, output: str) -> None:
    """Draw the result that `twin run ARTEFACT RUN -o OUTPUT` left in OUTPUT.

    Writes temperatures.png, tcp.png, workspace.png, surface.png and index.html beside it.
    """
    from pathlib import Path

    from twin.pictures.report import write_report
    from twin.progress import bar
    from twin.rom.artefact import read_artefact

    for path in write_report(read_artefact(Path(artefact)), Path(output), bar):
        click.echo(path)
