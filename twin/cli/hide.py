"""twin hide: a machine or a log with something in it that the description does not know."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from twin.inject.request import When


def _with_when(command: Callable[..., None]) -> Callable[..., None]:
    """The options that say when something acts as one argument, `when`."""

    @wraps(command)
    def called(
        history: str, signal: str, exponent: float, start: str | None, end: str | None, **others: Any
    ) -> None:  # fmt: skip
        from twin.cli.quantity import option
        from twin.inject.request import When

        first, last = (None if t is None else option(n, t, "s") for n, t in (("--from", start), ("--to", end)))
        command(when=When(history, signal, exponent, first, last), **others)

    return called


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
@click.option("--exponent", default=1.0, show_default=True, help="of that signal")
@click.option("--from", "start", help="time at which it begins, e.g. '4 h'")
@click.option("--to", "end", help="time at which it ends")
@click.option(
    "--setting", multiple=True, metavar="NAME=VALUE", help="what a family needs besides: temperature='15 degC'"
)
@click.option("--run", "runs", multiple=True, type=click.Path(), help="run that gets the switch; repeat it")
@_with_when
def command(
    family: str, place: str, size: str, target: str, output: str, when: When, setting: tuple[str, ...],
    runs: tuple[str, ...],
) -> None:  # fmt: skip
    """Hide an effect of SIZE ('10 W', '0.6 K', '3') at PLACE in a copy of a machine, or of a log.

    FAMILY is one of `twin diagnose`. `twin simulate` of a machine's copy is an experiment with a hidden effect; sensor,
    signal, slip, measurement, initial_state and not_thermal damage the copy of a run folder. hidden.json says what was
    hidden.
    """
    from pathlib import Path

    from twin.errors import TwinError
    from twin.inject.hide import hide

    settings = dict(s.partition("=")[::2] for s in setting)
    if unset := [s for s in setting if "=" not in s]:
        raise TwinError(f"'{unset[0]}' has no value", "--setting", "write it like --setting temperature='15 degC'")
    names = [Path(run).resolve().name for run in runs]
    if twice := sorted({n for n in names if names.count(n) > 1}):
        raise TwinError(f"two runs are called '{twice[0]}'", "--run", "rename a folder: copies keep these names")
    for line in hide(target, family, place, size, output, when, settings, runs):
        click.echo(line)
