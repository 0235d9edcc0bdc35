"""twin calibrate: fit an artefact's parameters to measured runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from twin.cli.bundle import bundled
from twin.cli.quantity import Quantity

if TYPE_CHECKING:
    from twin.calibrate.fit.fit import Iteration
    from twin.face.calibrate import CalibrateOptions, Window


def _options() -> type[Any]:
    from twin.face.calibrate import CalibrateOptions

    return CalibrateOptions


@click.command(
    epilog="Example: twin calibrate out/five_axis.h5 out/truth -o out/calibrated.h5 --only 'sources.*' --only 'films.*'"
)
@click.argument("artefact", type=click.Path())
@click.argument("runs", type=click.Path(), nargs=-1, required=True)
@click.option("-o", "--output", required=True, type=click.Path(), help="artefact to write")
@click.option(
    "--only", multiple=True, help="parameters to fit: a path, or a pattern such as 'sources.*'  [default: all]"
)
@click.option("--hold", multiple=True, help="parameters to leave as they are; both repeatable")
@click.option("--iterations", default=100, show_default=True, type=click.IntRange(1), help="stop after so many")
@click.option("--budget", default="10 min", show_default=True, type=Quantity("s"), help="stop after this time")
@click.option("--noise", default="0.1 K", show_default=True, type=Quantity("K"),
              help="standard deviation of one temperature sample")  # fmt: skip
@click.option("--tcp-noise", default="1 um", show_default=True, type=Quantity("m"),
              help="standard deviation of a TCP row where tcp.csv has no sigma")  # fmt: skip
@click.option("--initial", default="0.3 K", show_default=True, type=Quantity("K", zero=True),
              help="initial-temperature uncertainty where a run states none")  # fmt: skip
@click.option("--form", default=0.03, show_default=True, type=click.FloatRange(0, 1),
              help="share by which the model's response to each source may be wrong")  # fmt: skip
@click.option("--exclude", multiple=True, help="sensor to leave out; repeatable")
@click.option("--window", type=Quantity("s"),
              help="fit on sliding windows of this length, as on a running machine; RUNS is then one run")  # fmt: skip
@click.option("--every", default="1 h", show_default=True, type=Quantity("s"),
              help="with --window: time between fits")  # fmt: skip
@click.option("--machine", type=click.Path(), help="also write the edited description here")
@click.option("--json", "as_json", is_flag=True, help="print the report as JSON")
@bundled(_options)
def command(
    artefact: str, runs: tuple[str, ...], output: str, only: tuple[str, ...], hold: tuple[str, ...],
    machine: str | None, as_json: bool, options: CalibrateOptions,
) -> int:  # fmt: skip
    """Fit the parameters of ARTEFACT to the temperatures and TCP deviations measured in RUNS.

    Bounded least squares with priors; stops at the minimum, after --iterations or after --budget, and Ctrl-C during the
    iterations keeps the best values so far. Writes the artefact with the fitted values, OUTPUT.json with values,
    intervals, pulls, what the data cannot separate and which experiment would, and OUTPUT.png with every channel,
    measured and computed. Check it on a run it was not fitted to: `twin score`.
    """
    import json

    from twin.cli.calibrate_text import lines
    from twin.face.calibrate import calibrate, refuse_targets
    from twin.progress import bar, silent

    def iteration(i: Iteration) -> None:
        if not as_json:
            click.echo(f"  iteration {i.number}: cost {i.cost:.6g}, {i.seconds:.0f} s", err=True)

    def window(w: Window) -> None:
        if w.facts is None:
            click.echo(f"{w.hours:.1f} h: {w.problem}", err=as_json)
        elif not as_json:
            click.echo(_window(w.hours, w.facts))

    refuse_targets(output, machine, artefact)
    found = calibrate(artefact, runs, only, hold, options, silent if as_json else bar, iteration, window)
    found.save(output, machine)
    click.echo(json.dumps(found.facts, indent=1) if as_json else "\n".join(lines(found.facts, output)))
    return 130 if found.stopped == "interrupted" else 0


def _window(hours: float, facts: Any) -> str:
    """The parameters that moved most in a sliding window."""
    moved = sorted(facts["parameters"], key=lambda row: -abs(row["pull"]))[:3]
    what = ", ".join(f"{row['path']} {row['value']:.3g} +- {row['sigma']:.2g}" for row in moved)
    return f"{hours:.1f} h: {facts['stopped']}, {what}"
