"""`--sealed A B` means both, and what follows an option is never taken for an argument."""

from __future__ import annotations

import click
import pytest
from click.testing import CliRunner

from twin.cli.several import Several


@click.command()
@click.argument("runs", nargs=-1, required=True)
@click.option("--sealed", multiple=True, cls=Several)
@click.option("-o", "--output")
def command(runs, sealed, output):
    click.echo(f"{' '.join(runs)} | {' '.join(sealed)} | {output}")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("r --sealed a b -o x", "r | a b | x"),
        ("r s --sealed a --sealed b", "r s | a b | None"),
        ("r --sealed=a -o x", "r | a | x"),
        ("r -o x", "r |  | x"),
        ("--sealed a -o x r", "r | a | x"),
    ],
)
def test_values_go_where_they_stand(arguments, said):
    assert CliRunner().invoke(command, arguments.split()).output.strip() == said


def test_an_argument_after_the_values_is_missed():
    done = CliRunner().invoke(command, ["--sealed", "a", "r"])
    assert done.exit_code == 2
    assert "Missing argument" in done.output
