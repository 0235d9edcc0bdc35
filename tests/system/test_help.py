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


def calls_of(page):
    """The words after `.venv/bin/twin` of every command that a page shows in an indented block."""
    lines = [line.split("#")[0] for line in (ROOT / page).read_text(encoding="utf-8").splitlines()]
    return [shlex.split(line)[1:] for line in lines if line.startswith("    .venv/bin/twin ")]


@pytest.mark.parametrize("page", ["README.md", "docs/commands.md"])
def test_every_command_on_the_page_exists(page, monkeypatch):
    monkeypatch.chdir(ROOT)
    for name, *arguments in calls_of(page):
        load(name).make_context(name, list(arguments))
        assert all(Path(a).exists() for a in arguments if a.startswith(("models/", "tests/")))


def test_the_list_of_commands_is_complete():
    assert {name for name, *_ in calls_of("docs/commands.md")} == set(COMMANDS) - {"demo"}
    assert {name for name, *_ in calls_of("README.md")} == {
        "new",
        "check",
        "build",
        "run",
        "show",
        "live",
        "export",
        "calibrate",
        "diagnose",
    }
