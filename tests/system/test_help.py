"""The help of every command ends with an example that the command understands, about files that exist."""

import shlex
from pathlib import Path

import click
import pytest

from twin.cli.main import COMMANDS, cli, run

ROOT = Path(__file__).parents[2]


def load(name: str) -> click.Command:
    command = cli.get_command(click.Context(cli), name)
    assert command is not None
    return command


@pytest.mark.parametrize("name", COMMANDS)
def test_the_example_parses(name, monkeypatch):
    monkeypatch.chdir(ROOT)
    command = load(name)
    assert command.epilog is not None
    start, example = command.epilog.split(": ", 1)
    assert start == "\b\nExample"  # not wrapped: it is there to be pasted
    program, called, *arguments = shlex.split(example)
    assert (program, called) == ("twin", name)
    command.make_context(name, list(arguments))  # raises UsageError for unknown options and missing arguments
    paths = [Path(a) for a in arguments if a.startswith(("models/", "tests/"))]
    assert all(p.exists() for p in paths), paths


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_is_explained(name):
    silent = [o.name for o in load(name).params if isinstance(o, click.Option) and not o.help]
    assert not silent


def test_help_lists_every_command(capsys):
    assert run(["--help"]) == 0
    listed = capsys.readouterr().out
    assert all(f"\n  {name} " in listed for name in COMMANDS)


def test_every_command_in_the_readme_exists(monkeypatch):
    monkeypatch.chdir(ROOT)
    lines = [line.split("#")[0] for line in (ROOT / "README.md").read_text(encoding="utf-8").splitlines()]
    calls = [shlex.split(line) for line in lines if line.startswith("    .venv/bin/twin ")]
    assert {call[1] for call in calls} == set(COMMANDS) - {"demo"}
    for _, name, *arguments in calls:
        load(name).make_context(name, list(arguments))
        assert all(Path(a).exists() for a in arguments if a.startswith("models/"))
