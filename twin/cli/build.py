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
def command(machine: str, output: str, method: str, states: int, samples: int, training: int) -> int:
    """Reduce MACHINE to a compact artefact and certify it against the rich model on held-out scenarios."""
    from dataclasses import replace
    from pathlib import Path

    import h5py

    from twin.atomic import check_file
    from twin.build.pipeline import BuildOptions
    from twin.build.product import build_artefact
    from twin.cli.certificate_text import lines
    from twin.cli.sound import require_sound
    from twin.errors import TwinError
    from twin.progress import bar

    options = BuildOptions(method=method, states=states, training=training)  # type: ignore[arg-type]
    options = replace(options, rich=replace(options.rich, samples=samples))
    check_file(Path(output))
    if Path(output).suffix in (".toml", ".msh", ".csv"):
        raise TwinError("would replace an input", output, "name an artefact with -o, for example -o out/machine.h5")
    if Path(output).is_file() and Path(output).stat().st_size and not h5py.is_hdf5(output):
        raise TwinError("exists and is no artefact", output, "name a new file with -o; it would be replaced")
    require_sound(Path(machine))
    result = build_artefact(Path(machine), Path(output), options, bar)
    hint = f"twin verify {output}" if result.passed else "more --states, or larger [limits] in the description"
    click.echo("\n".join([f"wrote {output}", *lines(result), f"next: {hint}"]))
    return 0 if result.passed else 1
