"""twin live: the process beside the machine."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING, Any

import click

from twin.cli.bundle import bundled
from twin.cli.quantity import Quantity

if TYPE_CHECKING:
    from twin.face.live import LiveOptions


def _options() -> type[Any]:
    from twin.face.live import LiveOptions

    return LiveOptions


_GIVEN = "twin.cli.live.given"


class _Remembering(click.Command):
    """A command that keeps its arguments as they were written."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        ctx.meta[_GIVEN] = list(args)
        return super().parse_args(ctx, args)


@click.command(cls=_Remembering,
               epilog="Example: twin live out/five_axis.h5 --source replay:models/five_axis/runs/experiment_a "
               "--speed 1000 --out file:out/now.json --state out/live")  # fmt: skip
@click.argument("artefact", type=click.Path())
@click.option(
    "--source", required=True, help="csv:FILE that grows, replay:RUN, ring:FILE, mqtt:HOST:PORT/TOPIC, opcua:URL"
)
@click.option(
    "--out",
    required=True,
    multiple=True,
    help="file:FILE, ring:FILE, mqtt:HOST:PORT/TOPIC, opcua:URL; may be given again",
)
@click.option("--state", required=True, type=click.Path(), help="folder for journal, checkpoint and health record")
@click.option("--engine", type=click.Choice(["c", "jax"]), default="c", show_default=True,
              help="c: compiled once, starts in a moment; jax: needs no compiler")  # fmt: skip
@click.option("--form", type=click.Choice(["grid", "polynomial"]), default="grid", show_default=True,
              help="offsets of every axis at the poses, or coefficients")  # fmt: skip
@click.option("--initial", type=Quantity("degC", negative=True),
              help="temperature of the whole machine at a fresh start  [default: of the air around it]")  # fmt: skip
@click.option("--speed", type=float, default=1.0, show_default=True, help="factor of a replay; 0: as fast as possible")
@click.option("--limit", type=Quantity("m"), default="200 um", show_default=True, help="largest offset of an axis")
@click.option("--slew", type=Quantity("m/s"), default="0.2 um/s", show_default=True, help="fastest change of an offset")
@click.option("--period", type=Quantity("s"), default="1 s", show_default=True, help="time between outputs")
@click.option("--freeze", type=Quantity("s"), default="60 s", show_default=True,
              help="age of inputs at which the correction freezes")  # fmt: skip
@click.option("--neutral", type=Quantity("s"), default="600 s", show_default=True,
              help="age at which it returns to zero offsets")  # fmt: skip
@click.option("--journal", type=click.IntRange(1), default=256, show_default=True, help="MB of past blocks to keep")
@click.option(
    "--channels", type=click.Path(), help="TOML file: nodes of OPC UA, users and certificates, limits of values"
)
@click.option("--events", type=click.Path(),
              help="tcp.csv that grows, or folder of such: measured TCP errors that correct the model")  # fmt: skip
@click.option("--learn", type=click.Choice(["gain", "state"]),
              help="filter that learns: gain from events; state from events and temperatures, with --engine jax  "
              "[default: gain where there are events]")  # fmt: skip
@click.option("--fresh", is_flag=True, help="forget what is in the state folder")
@click.option("--print-unit", is_flag=True, help="print the systemd unit of this command, and do nothing else")
@bundled(_options)
def command(
    artefact: str, source: str, out: tuple[str, ...], state: str, print_unit: bool, options: LiveOptions
) -> None:
    """Run ARTEFACT beside the machine: load blocks in, axis offsets out, until the source ends or a signal comes.

    Killed at any time, it resumes where it was. STATE/health.json has its state.
    """
    if print_unit:
        from twin.live.install.unit import unit_of

        given = click.get_current_context().meta[_GIVEN]
        click.echo(unit_of([a for a in given if a not in ("--print-unit", "--fresh")], options.engine), nl=False)
        return
    from twin.face.live import live

    stopped: list[int] = []
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda got, _: stopped.append(got))
    runtime = live(artefact, source, out, state, options, lambda: bool(stopped))
    told = runtime.health()
    click.echo(f"{state}: {told['model']['steps']} steps, {told['input']['records']} records; {told['words']}")
    if runtime.failure:
        raise SystemExit(1)
