"""twin report: pictures of a result."""

from __future__ import annotations

import click


@click.command(epilog="Example: twin report out/five_axis.h5 out/experiment_a")
@click.argument("artefact", type=click.Path())
@click.argument("output", type=click.Path())
def command(artefact: str, output: str) -> None:
    """Draw the result that `twin run ARTEFACT RUN -o OUTPUT` left in OUTPUT.

    Writes temperatures.png, tcp.png, workspace.png and surface.png beside it, and index.html: the page of `twin serve`,
    which needs nothing beside it.
    """
    from pathlib import Path

    from twin.face.report import report
    from twin.progress import bar

    for path in report(artefact, Path(output), bar):
        click.echo(path)
