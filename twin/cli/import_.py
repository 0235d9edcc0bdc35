"""twin import: matrices of another program become an artefact."""

from __future__ import annotations

import re

import click

RANGES = {"films": (2.0, 40.0), "surroundings": (10.0, 40.0), "inputs": (0.0, 1000.0)}


def _ranges(context: click.Context, option: click.Parameter, given: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    """WHAT=LOW..HIGH of every option, over the defaults."""
    from twin.errors import TwinError

    found = dict(RANGES)
    for text in given:
        what, _, bounds = text.partition("=")
        parts = re.fullmatch(r"\s*(\S+?)\s*\.\.\s*(\S+)\s*", bounds)
        try:
            low, high = (float(v) for v in parts.groups()) if parts else (float("nan"),) * 2
        except ValueError:
            low = high = float("nan")
        if what not in RANGES or not low < high:
            remedy = f"write it like films=2..40; there are {', '.join(RANGES)}"
            raise TwinError(f"'{text}' is no range", "--range", remedy)
        found[what] = (low, high)
    return found


def _names(context: click.Context, option: click.Parameter, given: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    from twin.errors import TwinError

    found: dict[str, tuple[str, ...]] = {"outputs": (), "inputs": ()}
    for text in given:
        what, _, names = text.partition("=")
        if what not in found or not names:
            raise TwinError(f"'{text}' names nothing", "--names", "write it like outputs=nose,chuck or inputs=heater")
        found[what] = tuple(name.strip() for name in names.split(","))
    return found


@click.command(epilog="Example: twin import K.mtx C.mtx A1_web.mtx A2_foot.mtx Y.mtx -o out/rail.h5 --states 40")
@click.argument("files", nargs=-1, required=True, type=click.Path())
@click.option("-o", "--output", required=True, type=click.Path(), help="artefact to write")
@click.option("--range", "ranges", multiple=True, callback=_ranges, metavar="WHAT=LOW..HIGH",
              help="certified range of films [W/(m^2 K)], surroundings [degC], inputs [W where B sums to 1]; repeat  "
              "[default: films=2..40, surroundings=10..40, inputs=0..1000]")  # fmt: skip
@click.option("--names", multiple=True, callback=_names, metavar="outputs=A,B",
              help="names of all outputs, or of all inputs, in order; repeat")  # fmt: skip
@click.option("--reference", default=20.0, show_default=True, help="temperature that x is counted from [degC]")
@click.option("--method", type=click.Choice(["galerkin", "balanced"]), default="galerkin", show_default=True,
              help="as of twin build; galerkin of up to 64 states fits its basis, in half a minute")  # fmt: skip
@click.option("--states", default=100, show_default=True, type=click.IntRange(2), help="reduced states")
@click.option("--samples", default=24, show_default=True, type=click.IntRange(2), help="points of the rich basis")
def command(
    files: tuple[str, ...],
    output: str,
    ranges: dict[str, tuple[float, float]],
    names: dict[str, tuple[str, ...]],
    reference: float,
    method: str,
    states: int,
    samples: int,
) -> int:
    """Reduce and certify matrices that another program assembled: an artefact without a description.

    FILES are Matrix Market (.mtx), MATLAB (.mat) or SciPy (.npz) files, named K (or A = -K), C (or E), A1, A2, ...
    (films), B (inputs) and Y (outputs, or C beside E):

    C x' = -(K + sum h_k A_k) x + sum h_k A_k 1 T_k + B u,  y = Y x
    """
    from twin.build.matrices.model import MatrixOptions
    from twin.build.pipeline import BuildOptions
    from twin.build.rich_basis import RichOptions
    from twin.face.import_matrices import FILMS, import_matrices
    from twin.progress import bar

    matrices = MatrixOptions(
        ranges["films"], ranges["surroundings"], ranges["inputs"], reference, names["outputs"], names["inputs"]
    )
    options = BuildOptions(method, states, RichOptions(samples=samples), training=FILMS)  # type: ignore[arg-type]
    made = import_matrices(files, output, matrices, options, bar)
    click.echo(str(made))
    return 0 if made.model.certificate.passed else 1
