"""A description that `twin check` refuses is not computed with: no certificate would show a wrong unit."""

from __future__ import annotations

from pathlib import Path

import click

from twin.errors import TwinError


def require_sound(path: Path) -> None:
    """Tell the warnings of `twin check` about a description, raise TwinError for its errors, all of them."""
    from twin.build.check_meshes import check_meshes
    from twin.machine.check import check_machine
    from twin.machine.load import load_machine

    machine = load_machine(path)
    problems = [*check_machine(machine), *check_meshes(machine).problems]
    if errors := [p for p in problems if not p.warning]:
        raise TwinError.collect(errors)
    for problem in problems:
        click.echo(str(problem), err=True)
