"""`twin check`: everything that is wrong with a description or a run folder, before hours are spent on it."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import click


@click.command(epilog="Example: twin check models/five_axis/runs/experiment_a")
@click.argument("path", required=False, type=click.Path(path_type=Path))
@click.option(
    "--machine",
    "machine_path",
    type=click.Path(path_type=Path),
    help="Description or artefact to check a run against.",
)
@click.option("--no-meshes", is_flag=True, help="Check the description only.")
@click.option("--json", "as_json", is_flag=True, help="Print the findings as JSON.")
@click.option("--schema", is_flag=True, help="Print the JSON schema of machine.toml for editors, and end.")
def command(path: Path | None, machine_path: Path | None, no_meshes: bool, as_json: bool, schema: bool) -> int:
    """Find mistakes in PATH: a machine.toml, the folder it lies in, or a run folder.

    All mistakes are shown at once, with file, key and remedy. Exit status 2 if there are errors, 0 if only warnings.
    A run is checked against the signals of --machine, else of the machine that its run.toml names, else of the
    machine.toml two folders up (models/NAME/runs/RUN). Of a machine the last line is the command that shows it.
    """
    if schema:
        from twin.machine.load import json_schema

        click.echo(json.dumps(json_schema(), indent=1))
        return 0
    if path is None:
        raise click.UsageError("give the PATH of a machine.toml, its folder, or a run folder")
    from twin.face.check import check

    findings = check(path, machine_path, not no_meshes)
    click.echo(json.dumps(findings.to_json(), indent=1) if as_json else str(findings))
    if findings.kind == "machine" and findings.facts and not as_json:
        click.echo(f"see it: twin show {shlex.quote(str(path))}")
    return 0 if findings.ok else 2
