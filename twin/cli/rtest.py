"""twin rtest: single axis errors of the linear axes from R-tests."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from twin.cli.bundle import bundled
from twin.cli.quantity import Quantity

if TYPE_CHECKING:
    from twin.face.rtest import RTestOptions


def _options() -> type[Any]:
    from twin.face.rtest import RTestOptions

    return RTestOptions


@click.command(epilog="Example: twin rtest tests/calibrate/r_tests --chain w-C-B-Z-b-X-Y-t --at '2 h'")
@click.argument("run", type=click.Path())
@click.option("--chain", help="axes from workpiece over bed to tool, e.g. w-C-B-Z-b-X-Y-t; Z' where positive positions "
              "move what it carries against the machine coordinate  [default: that of --artefact]")  # fmt: skip
@click.option("--artefact", type=click.Path(), help="take the chain from this machine")
@click.option("--balls", type=click.Choice(["known", "unknown"]), default="known", show_default=True,
              help="unknown: an offset of each placing is fitted too; needs columns b [deg], c [deg]")  # fmt: skip
@click.option(
    "--gap", default="10 min", show_default=True, type=Quantity("s"), help="longer breaks divide measurements"
)
@click.option("--at", type=Quantity("s", negative=True),
              help="only the measurement nearest this time, e.g. '4 h'")  # fmt: skip
@click.option("--sigma", type=Quantity("m"),
              help="standard deviation of each reading  [default: that in tcp.csv, else of the residuals]")  # fmt: skip
@click.option(
    "--result", type=click.Path(), help="result of `twin run`: the same errors of the model, beside the measured ones"
)
@click.option("-o", "--output", type=click.Path(), help="folder for axis_errors.csv and rtest.json")
@click.option("--json", "as_json", is_flag=True, help="machine-readable")
@bundled(_options)
def command(
    run: str, chain: str | None, artefact: str | None, at: float | None, result: str | None, output: str | None,
    as_json: bool, options: RTestOptions,
) -> None:  # fmt: skip
    """Find single axis errors (ISO 230-1) of the linear axes from the R-tests in tcp.csv of RUN.

    Every measurement by itself: the errors at the end of the ranges with their standard deviations, those that it
    cannot show, the shift of the tool against the workpiece, and whether the residuals fit the noise. With --result
    also how much of the computed volumetric error is axis errors.
    """
    import json

    from twin.cli.rtest_text import text
    from twin.face.rtest import rtest

    found = rtest(run, chain, artefact, at, result, options, output)
    click.echo(json.dumps(found.facts, indent=2) if as_json else text(found.facts))
