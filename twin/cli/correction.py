"""twin correction: polynomials of the TCP error for the control."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from pathlib import Path


@click.command(epilog="Example: twin correction out/five_axis.h5 out/experiment_a --time '4 h' -o out/correction.json")
@click.argument("artefact", type=click.Path())
@click.argument("result", type=click.Path())
@click.option("-o", "--output", required=True, type=click.Path(), help="file to write, correction.json")
@click.option("--time", help="since the start of the run, e.g. '4 h'  [default: its end]")
@click.option("--degree", help="of the polynomial along every axis, '2', or 'x=4,y=2'  "
              "[default: 2, or 4 where there is one axis]")  # fmt: skip
@click.option("--form", type=click.Choice(["full", "product"]), default="full", show_default=True,
              help="all products of powers, or one factor per axis, smaller and worse")  # fmt: skip
@click.option("--zero-at", help="position of the only axis where the error is held at zero, e.g. '-500 mm': "
              "the fixed bearing, if it does not move; within the stroke  [default: a constant is fitted]")  # fmt: skip
def command(
    artefact: str, result: str, output: str, time: str | None, degree: str | None, form: str, zero_at: str | None
) -> None:
    """Compress the TCP error that `twin run ARTEFACT RUN -o RESULT` found at all poses, at one time, for the control.

    An older correction is replaced, another file never.
    Writes the coefficients with centre and half-range of every axis, the axis offsets that cancel the error, and what
    they leave.
    """
    from pathlib import Path

    from twin.atomic import check_file
    from twin.cli.quantity import option, positive
    from twin.rom.artefact import read_artefact
    from twin.run.correction import check_zero, default_degrees, fit_correction, quality
    from twin.run.correction_axes import axis_jacobian
    from twin.run.correction_file import read_pose_errors, write_correction

    wanted = None if time is None else positive("--time", time, "s", zero=True)
    zero = None if zero_at is None else option("--zero-at", zero_at, "m")
    check_file(Path(output))
    _check_output(Path(output))
    loaded = read_artefact(Path(artefact))
    errors, at = read_pose_errors(Path(result), loaded.digest, wanted)
    if zero is not None:
        check_zero(zero, errors.axes, loaded.model.load_model.axes)
    degrees = _degrees(degree, errors.axes, default_degrees(errors))
    correction = fit_correction(errors, axis_jacobian(loaded, errors.axes), degrees, form, zero)  # type: ignore[arg-type]
    found = quality(correction, errors)
    facts = {"machine": loaded.model.name, "artefact": loaded.digest, "result": result, "time_s": at}
    write_correction(Path(output), correction, found, facts)
    count = correction.polynomial.coefficients.size
    if form == "product":
        count = sum(f.size for component in correction.factors for f in component)
    click.echo(
        f"{output}: {count} coefficients in {form} form for {', '.join(errors.axes)} after {at / 3600:g} h; "
        f"condition {found.condition:.3g}"
    )
    if form == "product":
        click.echo("compressed: a product of factors cannot meet every pose; see the misfit")
    for label, values in (
        ("largest TCP error at the poses", found.before),
        ("misfit of the polynomial at the poses, largest", found.residual),
        ("the same, rms", found.residual_rms),
        ("misfit between the poses, largest", found.between),
        ("in directions that no axis moves in", found.uncorrectable),
        ("left at the poses when corrected", found.after),
        ("left between the poses when corrected", found.after_between),
    ):
        numbers = "  ".join(f"d{c} {1e6 * v:.3f}" for c, v in zip("xyz", values, strict=True))
        click.echo(f"  {label:<48} {numbers} um")


def _check_output(path: Path) -> None:
    """Raises TwinError where `path` is a file that is no correction of this program: it is not for us to replace."""
    from twin.errors import TwinError
    from twin.run.correction_file import read_correction

    if not path.exists():
        return
    try:
        read_correction(path)
    except TwinError as e:
        what = "exists and is not a correction of this version, so it is not replaced"
        raise TwinError(what, str(path), "choose another file with -o") from e


def _degrees(text: str | None, axes: tuple[str, ...], default: tuple[int, ...]) -> tuple[int, ...]:
    """Degrees per axis from '2' or 'x=4,y=2'. Raises TwinError for unknown axes and what is no whole number."""
    from twin.errors import TwinError
    from twin.nearest import did_you_mean

    if text is None:
        return default
    degrees = dict(zip(axes, default, strict=True))
    for item in text.split(","):
        axis, equals, number = item.strip().rpartition("=")
        value = int(number) if number.strip().isdecimal() and len(number.strip()) < 9 else -1
        if value < 0:
            raise TwinError(f"'{item.strip()}' is no degree", "--degree", "write --degree 2, or --degree x=4,y=2")
        if equals and axis.strip() not in degrees:
            remedy = did_you_mean(axis.strip(), axes, "axes of the poses")
            raise TwinError(f"no axis '{axis.strip()}'", "--degree", remedy)
        degrees |= {axis.strip(): value} if equals else dict.fromkeys(axes, value)
    return tuple(degrees[a] for a in axes)
