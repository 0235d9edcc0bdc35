"""twin new: a machine from a template, or from nothing but a log."""

from __future__ import annotations

import click

from twin.cli.several import Several


def _pairs(context: click.Context, option: click.Parameter, given: tuple[str, ...]) -> dict[str, str]:
    """NAME=VALUE of every option; the name may hold any sign but the last '='."""
    from twin.errors import TwinError

    if unset := [s for s in given if "=" not in s]:
        raise TwinError(f"'{unset[0]}' has no value", f"--{option.name}", "write it like --unit 'PT01=degC'")
    return {name: value for name, _, value in (s.rpartition("=") for s in given)}


@click.command(epilog="Example: twin new out/mill --template three_axis")
@click.argument("folder", type=click.Path())
@click.option("--template", help="box: a bed and a column; three_axis: a machining centre of boxes; lumped: no mesh")
@click.option("--from-log", "logs", multiple=True, cls=Several, type=click.Path(),
              help="CSV or XLSX files, or run folders")  # fmt: skip
@click.option(
    "--sealed", multiple=True, cls=Several, type=click.Path(), help="logs that are scored and never fitted to"
)
@click.option("--unit", "units", multiple=True, callback=_pairs, metavar="COLUMN=UNIT",
              help="unit that neither header nor guess tells; COLUMN= leaves it out; repeat")  # fmt: skip
@click.option("--axis", "axes", multiple=True, callback=_pairs, metavar="dx=COLUMN",
              help="column that measures a displacement; repeat")  # fmt: skip
def command(
    folder: str,
    template: str | None,
    logs: tuple[str, ...],
    sealed: tuple[str, ...],
    units: dict[str, str],
    axes: dict[str, str],
) -> None:
    """Begin a machine in FOLDER from a template, or propose one that predicts the displacements of logs.

    --template: a description whose comments teach, with a run, which builds, verifies and runs as it is.

    --from-log: a lumped network, its runs and a page.

    Columns are taken for what their headers say, else guessed by name and values, and shown. Each node follows a logged
    temperature, or the heat of a logged speed or power, with one time constant; how far each moves the tool is fitted
    to all logs. The page compares it with ridge regression on runs that neither has seen.
    """
    from twin.errors import TwinError

    if (template is None) == (not logs):
        raise TwinError("give either a template or logs", "twin new", f"twin new {folder} --template box, for example")
    if template is not None:
        from twin.face.template import from_template

        if sealed or units or axes:
            raise TwinError("--sealed, --unit and --axis are of logs", "twin new", "leave them out with --template")
        click.echo(str(from_template(template, folder)))
        return
    from twin.face.new import NewOptions, from_log
    from twin.progress import bar

    if wrong := [axis for axis in axes if axis not in ("dx", "dy", "dz")]:
        raise TwinError(f"no axis '{wrong[0]}'", "--axis", "write it like --axis 'dx=Disp. X'")
    click.echo(str(from_log(logs, folder, sealed, NewOptions(units, axes), bar)))
