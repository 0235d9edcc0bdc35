"""twin hide: a machine or a log with a fault that is not in the description."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from twin.cli.bundle import bundled
from twin.cli.quantity import Quantity

if TYPE_CHECKING:
    from twin.face.hide import HideOptions


def _options() -> type[Any]:
    from twin.face.hide import HideOptions

    return HideOptions


def _settings(context: click.Context, option: click.Parameter, given: tuple[str, ...]) -> dict[str, str]:
    """NAME=VALUE of every --setting."""
    from twin.errors import TwinError

    if unset := [s for s in given if "=" not in s]:
        raise TwinError(f"'{unset[0]}' has no value", "--setting", "write it like --setting temperature='15 degC'")
    return dict(s.partition("=")[::2] for s in given)


@click.command(
    context_settings={"ignore_unknown_options": True},  # "-3 K" is a size
    epilog="Example: twin hide heat_source bed.x_motor '10 W' models/five_axis -o out/hidden --from '4 h' --to '6 h' "
    "--run models/five_axis/runs/experiment_a",
)
@click.argument("family")
@click.argument("place")
@click.argument("size")
@click.argument("target", type=click.Path(), metavar="MACHINE|RUN")
@click.option("-o", "--output", required=True, type=click.Path(), help="folder to write")
@click.option("--history", default="", help="kind of a fault of a log: offset, drift, lag, ...")
@click.option("--signal", default="", help="logged signal that it follows")
@click.option("--exponent", default=1.0, show_default=True, help="exponent of that signal")
@click.option("--from", "start", type=Quantity("s", negative=True), help="time at which it begins, e.g. '4 h'")
@click.option("--to", "end", type=Quantity("s", negative=True), help="time at which it ends")
@click.option(
    "--setting", "settings", multiple=True, callback=_settings, metavar="NAME=VALUE",
    help="what a family needs besides: temperature='15 degC'",
)  # fmt: skip
@click.option("--run", "runs", multiple=True, type=click.Path(), help="run that gets the switch; repeat it")
@bundled(_options)
def command(
    family: str, place: str, size: str, target: str, output: str, options: HideOptions, runs: tuple[str, ...]
) -> None:
    """Inject a fault of SIZE ('10 W', '0.6 K', '3') at PLACE in a copy of a machine, or of a log.

    FAMILY is one of `twin diagnose`. `twin simulate` of a machine's copy is an experiment with a hidden fault; sensor,
    signal, slip, measurement, initial_state and not_thermal damage the copy of a run folder. hidden.json says what was
    hidden.
    """
    from twin.face.hide import told

    for line in told(target, family, place, size, output, options, runs):
        click.echo(line)
