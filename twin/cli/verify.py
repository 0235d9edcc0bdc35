"""twin verify: does an artefact keep its limits on scenarios it has never seen?"""

from __future__ import annotations

import click


@click.command(epilog="Example: twin verify out/five_axis.h5")
@click.argument("artefact", type=click.Path())
@click.option("--machine", type=click.Path(), help="its description, where it has moved since the build")
@click.option(
    "--full", default=2, show_default=True, type=click.IntRange(2, 19), help="scenarios stepped with the full model"
)
@click.option("--mesh", is_flag=True, help="also the error of the mesh, by a finer one: up to some minutes more")
@click.option("--json", "as_json", is_flag=True, help="print the certificate as JSON")
def command(artefact: str, machine: str | None, full: int, mesh: bool, as_json: bool) -> int:
    """Step ARTEFACT beside the rich model on 19 held-out scenarios, and the rich beside the full model on some.

    Stores the certificate in the artefact. Exit status 1 if an error is above the machine's limits. The error of the
    mesh is stated beside the others and not judged: it is the full model's, which the artefact is measured by.
    """
    import json
    from pathlib import Path

    from twin.build.product import verify_artefact
    from twin.face.certificate import Certificate
    from twin.progress import bar, silent

    progress, where = silent if as_json else bar, Path(machine) if machine else None
    result = verify_artefact(Path(artefact), where, full_scenarios=full, progress=progress, mesh=mesh)
    told = result.to_json()
    click.echo(json.dumps(told, indent=1) if as_json else "\n".join(Certificate(told).lines(every_output=True)))
    return 0 if result.passed else 1
