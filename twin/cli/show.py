"""twin show: a machine as it is described, as a page."""

from __future__ import annotations

import click


@click.command(epilog="Example: twin show models/five_axis -o out/five_axis.html")
@click.argument("machine", type=click.Path())
@click.option("-o", "--output", type=click.Path(), help="the page; NAME.html in the current folder by default")
def command(machine: str, output: str | None) -> None:
    """Write a page that shows MACHINE as it is described, before anything is built.

    The machine to turn, axes to slide, and every surface, film, source, sensor and contact to click. Red is what no
    film and no contact covers: it exchanges no heat. A lumped machine is shown as its network. The page needs nothing
    beside it. Meshes are read, and nothing is assembled.
    """
    from twin.face.show import show

    click.echo(str(show(machine, output)))
