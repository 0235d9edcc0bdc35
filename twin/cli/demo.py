"""twin demo: the whole story on the shipped machine, by the commands a user would type."""

from __future__ import annotations

import click


@click.command(epilog="Example: twin demo -o out")
@click.option("-o", "--output", default="out", show_default=True, type=click.Path(), help="folder to write to")
def command(output: str) -> int:
    """Build the shipped five-axis machine, verify it, run experiment A of paper 000, and draw the result.

    Exit status 1 if the certificate is above the machine's limits.
    """
    import shlex
    import shutil
    import sys
    import time
    from pathlib import Path

    from twin.cli.main import run
    from twin.errors import TwinError

    machine = Path(__file__).parents[2] / "models" / "five_axis"
    if not (machine / "machine.toml").exists():
        raise TwinError("the shipped machine is not here", str(machine), "run the demo in a clone of the repository")
    if machine.is_relative_to(Path.cwd()):
        machine = machine.relative_to(Path.cwd())
    artefact, result = f"{output}/five_axis.h5", f"{output}/experiment_a"
    experiment = f"{machine}/runs/experiment_a"
    began = time.perf_counter()
    kept = True
    for title, arguments in (
        ("reduce the machine to an artefact", ["build", str(machine), "-o", artefact]),
        ("test it on scenarios it has never seen, against the full model", ["verify", artefact]),
        ("run experiment A: X moves for 4 h, then 8 h at rest", ["run", artefact, experiment, "-o", result]),
        ("draw the result", ["report", artefact, result]),
    ):
        click.secho(f"\n{title}", bold=True)
        click.echo(f"$ twin {shlex.join(arguments)}")
        status = run(arguments)
        if status > 1:
            return status
        kept &= status == 0
    program = "twin" if shutil.which("twin") else sys.argv[0]
    click.secho(f"\ndone in {time.perf_counter() - began:.0f} s", bold=True)
    click.echo(
        f"made   {artefact}: the artefact ({program} info {artefact})\n"
        f"       {result}/result.h5, temperatures.csv, tcp.csv, summary.json: the numbers\n"
        f"       {result}/index.html: the pictures\n"
        f"next   change something and see what it does:\n"
        f"       {program} run {artefact} {experiment} --dt '30 s' -o {output}/finer\n"
        f"       edit a conductance in {machine}/machine.toml, then: {program} check {machine}\n"
        f"       {program} simulate {machine} {experiment} --hours 1 -o {output}/truth    the full model\n"
        f"       notebooks/build_and_run.ipynb    the same story step by step"
    )
    if not kept:
        click.echo("the certificate is above the machine's limits: see above", err=True)
    return 0 if kept else 1
