"""twin diagnose: find why simulation and measurement differ, name the cause, extend the model, measure the gain."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from twin.cli.bundle import bundled
from twin.cli.quantity import Quantity
from twin.cli.several import Several

if TYPE_CHECKING:
    from twin.face.diagnose import DiagnoseOptions


def _options() -> type[Any]:
    from twin.face.diagnose import DiagnoseOptions

    return DiagnoseOptions


@click.command(
    epilog="Example: twin diagnose out/five_axis.h5 out/monday out/tuesday --sealed out/wednesday -o out/diagnosis"
)
@click.argument("artefact", type=click.Path(), required=False)
@click.argument("runs", type=click.Path(), nargs=-1)
@click.option(
    "--sealed", multiple=True, cls=Several, type=click.Path(), help="validation runs, never fitted to; used last"
)
@click.option("-o", "--output", type=click.Path(), help="folder of the report")
@click.option("--noise", default="0.1 K", show_default=True, type=Quantity("K"),
              help="standard deviation of one temperature reading")  # fmt: skip
@click.option("--tcp-noise", default="1 um", show_default=True, type=Quantity("m"),
              help="standard deviation of a TCP row where tcp.csv has no sigma")  # fmt: skip
@click.option("--exclude", multiple=True, help="sensor to leave out; repeatable")
@click.option("--nulls", default=100, show_default=True, type=click.IntRange(20),
              help="fault-free simulations for thresholds; 60 more for model discrepancy")  # fmt: skip
@click.option("--catalogue", type=click.Path(), help="Python file with entries of your own (FAMILIES)")
@click.option("--machine", type=click.Path(), help="description with its meshes, where it has moved since the build")
@click.option("--no-build", is_flag=True, help="write the extended description, but do not build its artefact")
@click.option("--plan", metavar="[SUSPICION]", is_flag=False, flag_value="",
              help="propose the next experiment for a suspicion ('FAMILY PLACE', as report.json prints them; FAMILY "
              "alone: its worst place; none: what the verdict does not separate)")  # fmt: skip
@click.option("--seed", default=1, show_default=True, type=click.IntRange(0), help="seed of the bootstrap")
@click.option("--explain", metavar="FAMILY", help="print an entry of the catalogue, or 'all'")
@bundled(_options)
def command(
    artefact: str | None, runs: tuple[str, ...], sealed: tuple[str, ...], output: str | None, machine: str | None,
    no_build: bool, explain: str | None, options: DiagnoseOptions,
) -> int:  # fmt: skip
    """Find why ARTEFACT differs from the measured RUNS; write a corrected description.

    Writes OUTPUT/index.html (readable as it is), OUTPUT/report.json, and, where a cause belongs into the description,
    OUTPUT/machine.toml with the cause added and OUTPUT/extended.h5 built from it. Files of an earlier diagnosis in
    OUTPUT are replaced. The artefact stays untouched.
    """
    from pathlib import Path

    from twin.errors import TwinError
    from twin.face.diagnose import diagnose, explained

    if explain is not None:
        click.echo(explained(explain, options))
        return 0
    if artefact is None or not runs:
        raise TwinError("an artefact and measured runs are needed", "twin diagnose", "see twin diagnose --help")
    if output is None:
        raise TwinError("no folder for the report", "-o", "name one, for example -o out/diagnosis")

    from twin.diagnose.extend import build_extension
    from twin.progress import bar

    report = diagnose(artefact, runs, sealed, machine, options, output, bar).report(output, build=False)
    click.echo(str(report))
    if report.files and not no_build:  # minutes, in which all else is there already
        click.echo(build_extension(Path(output), bar))
    return 0
