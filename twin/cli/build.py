"""twin build: a machine description becomes an artefact."""

from __future__ import annotations

import click


@click.command(epilog="Example: twin build models/five_axis/machine.toml -o out/five_axis.h5")
@click.argument("machine", type=click.Path())
@click.option("-o", "--output", required=True, type=click.Path(), help="artefact to write")
@click.option(
    "--method",
    type=click.Choice(["galerkin", "balanced"]),
    default="galerkin",
    show_default=True,
    help="galerkin is stable by construction; balanced is more accurate per state, admitted by a stability check",
)
@click.option("--states", default=500, show_default=True, help="reduced states of the whole machine")
@click.option("--samples", default=16, show_default=True, type=click.IntRange(2), help="points of the rich basis")
@click.option("--training", default=90, show_default=True, type=click.IntRange(1), help="training scenarios")
@click.option(
    "--substeps",
    type=click.IntRange(1),
    help="substeps of the time integrator [default: as few of 1, 2, 4 as keep its error below half of the limits]",
)
def command(
    machine: str, output: str, method: str, states: int, samples: int, training: int, substeps: int | None
) -> int:
    """Reduce MACHINE to a compact artefact and certify it against the rich model on held-out scenarios."""
    from twin.build.pipeline import BuildOptions
    from twin.build.rich_basis import RichOptions
    from twin.face.build import build
    from twin.progress import bar

    rich = RichOptions(samples=samples)
    options = BuildOptions(method, states, rich, training, substeps=substeps)  # type: ignore[arg-type]
    certificate = build(machine, output, options, bar).certificate
    hint = f"twin verify {output}" if certificate.passed else "the remedy named after FAILED, then build again"
    click.echo("\n".join([f"wrote {output}", *certificate.lines(), f"next: {hint}"]))
    return 0 if certificate.passed else 1
