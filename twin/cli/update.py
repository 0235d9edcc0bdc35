"""twin update: a run in which sparse TCP measurements correct the model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from twin.cli.bundle import bundled
from twin.cli.quantity import Quantity

if TYPE_CHECKING:
    from twin.face.update import UpdateOptions


def _options() -> type[Any]:
    from twin.face.update import UpdateOptions

    return UpdateOptions


@click.command(epilog="Example: twin update out/five_axis.h5 out/truth --interval '1 h' -o out/update")
@click.argument("artefact", type=click.Path())
@click.argument("run", type=click.Path())
@click.option("--method", type=click.Choice(["state", "gain", "paper"]), default="state", show_default=True,
              help="Kalman filter on thermal state and parameters, with all sensors; bounded gain and offset per axis; "
              "or the gain of paper 003 as printed")  # fmt: skip
@click.option("--interval", type=Quantity("s"),
              help="use a TCP measurement this often, e.g. '30 min'; the others are only predicted  "
              "[default: as measured]")  # fmt: skip
@click.option("--tolerance", type=Quantity("m"),
              help="let a scheduler ask for measurements so that the standard deviation of the error "
              "stays below this, e.g. '3 um'; the row that follows a request is used")  # fmt: skip
@click.option("--earlier", multiple=True, type=click.Path(), help="a run measured before, from which to learn how far "
              "the model may be off where no parameter explains it (method state; may be repeated)")  # fmt: skip
@click.option("--slew", default="5 um", show_default=True, type=Quantity("m"),
              help="most by which the correction moves in a minute")  # fmt: skip
@click.option("--tcp-noise", default="1 um", show_default=True, type=Quantity("m"),
              help="standard deviation of TCP measurements without a sigma")  # fmt: skip
@click.option("--noise", default="0.1 K", show_default=True, type=Quantity("delta_degC"),
              help="standard deviation of a temperature reading")  # fmt: skip
@click.option("--dt", default="60 s", show_default=True, type=Quantity("s"), help="time step")
@click.option("-o", "--output", type=click.Path(), help="folder for update.h5, tcp.csv, summary.json, state")
@click.option("--json", "as_json", is_flag=True, help="print the summary as JSON")
@bundled(_options)
def command(
    artefact: str, run: str, earlier: tuple[str, ...], output: str | None, as_json: bool, options: UpdateOptions
) -> None:
    """Replay RUN online with the model of ARTEFACT, as beside the machine: measurements correct what follows.

    Every row of the run's tcp.csv is predicted before it is used. The model itself stays as it is; the correction is
    kept beside it, with the standard deviation of what it leaves. The default method of `twin live` is gain.
    """
    import json

    from twin.face.update import update
    from twin.progress import bar, silent

    found = update(artefact, run, options, earlier, output, silent if as_json else bar)
    click.echo(json.dumps(found.facts, indent=2) if as_json else "\n".join(_lines(found.facts)))


def _lines(told: Mapping[str, Any]) -> list[str]:
    """The summary for people."""
    lines = [
        f"{told['machine']}, method {told['method']}: {told['used']} of {told['rows']} TCP measurements used; "
        f"largest correction {1e6 * max(told['largest_correction_m']):.1f} um, "
        f"by at most {1e6 * told['largest_step_of_correction_m']:.2f} um a step"
    ]
    if told["counted_from_s"] is not None:
        lines.append(
            f"deviations count from the row at {told['counted_from_s'] / 3600:.2f} h: they stand on what was predicted "
            f"there, and what that is wrong all errors keep"
        )
    if "discrepancy" in told:
        lines.append(
            f"earlier runs are most likely with {told['discrepancy']['factor']:g} times the prior discrepancies"
        )
    if told["unknown_sensors"]:
        lines.append(f"not sensors of the machine: {', '.join(told['unknown_sensors'])}")
    if told["rows_left_out"]:
        lines.append(f"{told['rows_left_out']} rows of tcp.csv left out: outside the loads' time, or incomplete")
    if told["asked_s"]:
        lines.append("asked for a measurement after " + ", ".join(f"{t / 3600:.2f}" for t in told["asked_s"]) + " h")
    titles = {"all": "every row before it was used", "after_first": "the same after the first measurement used"}
    for part, scores in told["before_assimilating"].items():
        lines.append(f"{titles[part]} [um, and share of the error computed]:")
        for name, by_output in scores.items():
            cells = [_cell(output, figures) for output, figures in by_output.items()]
            lines.append(f"  {name.replace('_', ' '):<10}" + "   ".join(cells))
    if told["coverage_95"] is not None:
        lines.append(f"{told['coverage_95']:.0%} of the rows lie inside their predicted 95 % interval")
    for gated in told["rejected_tcp"]:
        lines.append(
            f"left out: {gated['axis']} after {gated['time_s'] / 3600:.2f} h, {1e6 * gated['innovation_m']:+.1f} um "
            f"from its prediction ({1e6 * gated['sigma_m']:.1f} um expected)"
        )
    sensors = {n: k for n, k in told["rejected"].items() if n not in ("dx", "dy", "dz")}
    for name, count in sensors.items():
        lines.append(f"left out: {count} readings of sensor {name} that nothing explains")
    return lines


def _cell(output: str, figures: dict[str, Any]) -> str:
    share = "   -  " if figures["share"] is None else f"{figures['share']:6.1%}"
    return f"{output} rms {1e6 * figures['rms']:5.2f} max {1e6 * figures['max_abs']:5.1f} {share}"
