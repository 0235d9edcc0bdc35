"""twin score: an artefact on measured runs, beside naive baselines."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from twin.cli.bundle import bundled
from twin.cli.quantity import Quantity
from twin.cli.several import Several

if TYPE_CHECKING:
    from twin.face.score import ScoreOptions


def _options() -> type[Any]:
    from twin.face.score import ScoreOptions

    return ScoreOptions


def _names(ctx: click.Context, param: click.Parameter, value: str | None) -> tuple[str, ...]:
    return tuple(name.strip() for name in value.split(",") if name.strip()) if value else ()


@click.command(epilog="Example: twin score out/five_axis.h5 out/truth -o out/score")
@click.argument("artefact", type=click.Path())
@click.argument("runs", nargs=-1, required=True, type=click.Path())
@click.option(
    "--sealed",
    multiple=True,
    cls=Several,
    type=click.Path(),
    help="runs kept back from every fit, scored by themselves",
)
@click.option(
    "--train", multiple=True, cls=Several, type=click.Path(), help="runs that baselines learn from, not scored"
)
@click.option("--inputs", callback=_names,
              help="columns that learned baselines read, 't1,t5,spindle_speed'  [default: temperatures]")  # fmt: skip
@click.option("--restart", is_flag=True, help="segments are tests of their own, each from its own initial state")
@click.option("--hold-interval", default="0 s", show_default=True, type=Quantity("s", zero=True),
              help="time between the measurements that 'hold last' may use; 0: all of them")  # fmt: skip
@click.option("--tcp-noise", default="1 um", show_default=True, type=Quantity("m"),
              help="standard deviation where tcp.csv has none")  # fmt: skip
@click.option("--noise", default="0.1 K", show_default=True, type=Quantity("K"),
              help="standard deviation of a sensor")  # fmt: skip
@click.option("--dt", default="60 s", show_default=True, type=Quantity("s"), help="time step")
@click.option("--substeps", type=click.IntRange(1), help="substeps of the integrator; default: as the certificate says")
@click.option("-o", "--output", type=click.Path(), help="folder for score.json and score.csv")
@click.option("--json", "as_json", is_flag=True, help="print everything as JSON")
@bundled(_options)
def command(
    artefact: str, runs: tuple[str, ...], sealed: tuple[str, ...], train: tuple[str, ...], output: str | None,
    as_json: bool, options: ScoreOptions,
) -> None:  # fmt: skip
    """Replay every RUN on ARTEFACT and compare with what was measured, beside what needs no model.

    Scored per sensor and axis, per segment and pooled, sealed runs by themselves: rms, largest, p2p in two definitions,
    fit and the share that is computed (docs/scores.md). Baselines: zero, the last measurement held, ridge regression on
    the temperatures, ARX and output-error transfer functions. They learn from the --train runs; without any, from the
    other runs or from what was measured before.
    """
    import json

    from twin.face.score import score
    from twin.progress import bar, silent

    found = score(artefact, runs, sealed, train, options, output, silent if as_json else bar)
    click.echo(json.dumps(dict(found.facts), indent=1, allow_nan=False) if as_json else str(found))
