"""twin correction: polynomials of the TCP error for the control."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import click

from twin.cli.bundle import bundled
from twin.cli.quantity import Quantity

if TYPE_CHECKING:
    from twin.face.correction import RotaryOptions


def _options() -> type[Any]:
    from twin.face.correction import RotaryOptions

    return RotaryOptions


@click.command(epilog="Example: twin correction out/five_axis.h5 out/experiment_a --time '4 h' -o out/correction.json")
@click.argument("artefact", type=click.Path())
@click.argument("result", type=click.Path())
@click.option("-o", "--output", required=True, type=click.Path(), help="file to write, correction.json")
@click.option(
    "--time", type=Quantity("s", zero=True), help="since the start of the run, e.g. '4 h'  [default: its end]"
)
@click.option("--degree", help="degree of the polynomial along every axis, '2', or 'x=4,y=2'  "
              "[default: 2, or 4 where there is one axis]")  # fmt: skip
@click.option("--form", type=click.Choice(["full", "product"]), default="full", show_default=True,
              help="all products of powers, or one factor per axis, smaller and worse")  # fmt: skip
@click.option("--zero-at", type=Quantity("m", negative=True),
              help="position of the only axis where the error is held at zero, e.g. '-500 mm': "
              "the fixed bearing, if it does not move; within the stroke  [default: a constant is fitted]")  # fmt: skip
@click.option("--angles", help="angles of rotary axes that turn tool or work, 'b=30 deg,c=90 deg'  [default: zero]")
@click.option("--rotary", is_flag=True, help="offsets of the rotary axes besides, which take up tilt about them")
@bundled(_options)
def command(
    artefact: str, result: str, output: str, time: float | None, degree: str | None,
    form: Literal["full", "product"], zero_at: float | None, options: RotaryOptions,
) -> None:  # fmt: skip
    """Compress the TCP error that `twin run ARTEFACT RUN -o RESULT` found at all poses, at one time, for the control.

    An older correction is replaced, another file never.
    Writes the coefficients with centre and half-range of every axis, the axis offsets that cancel the error, and what
    they leave.
    """
    from twin.face.correction import correct

    made = correct(artefact, result, output, time, degree, form, zero_at, options)
    correction, found = made.correction, made.quality
    count = correction.polynomial.coefficients.size
    if form == "product":
        count = sum(f.size for component in correction.factors for f in component)
    click.echo(
        f"{output}: {count} coefficients in {form} form for {', '.join(made.axes)} after {made.time / 3600:g} h; "
        f"condition {found.condition:.3g}"
    )
    if form == "product":
        click.echo("compressed: a product of factors cannot meet every pose; see the misfit")
    error = "TCP error" if len(found.before) == 3 else "error of strut lengths"
    for label, values in (
        (f"largest {error} at the poses", found.before),
        ("misfit of the polynomial at the poses, largest", found.residual),
        ("the same, rms", found.residual_rms),
        ("misfit of the product form, eq (16.1) as printed", found.product_form),
        ("misfit between the poses, largest", found.between),
        ("in directions that no axis moves in", found.uncorrectable),
        ("left at the poses when corrected", found.after),
        ("left between the poses when corrected", found.after_between),
    ):
        numbers = "  ".join(f"{c} {1e6 * v:.3f}" for c, v in zip(found.components, values, strict=True))
        click.echo(f"  {label:<48} {numbers} um")
    if found.tilt is not None:
        numbers = "  ".join(f"r{c} {1e6 * v:.3f}" for c, v in zip("xyz", found.tilt, strict=True))
        click.echo(f"  {'tilt at the poses, which linear axes leave':<48} {numbers} urad")
    if made.rotary is not None:
        for label, values, unit in (
            ("left at the poses, rotary axes helping", made.rotary.left, "um"),
            ("tilt left at the poses, rotary axes helping", made.rotary.left_tilt, "urad"),
        ):
            numbers = "  ".join(
                f"{'d' if unit == 'um' else 'r'}{c} {1e6 * v:.3f}" for c, v in zip("xyz", values, strict=True)
            )
            click.echo(f"  {label:<48} {numbers} {unit}")
