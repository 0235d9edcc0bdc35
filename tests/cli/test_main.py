"""The command line: lazy, one block per error, exit statuses."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import types

import click
import pytest

from twin import __version__
from twin.cli import main
from twin.errors import DescriptionError, Problem


@pytest.fixture
def failing(monkeypatch):
    """Makes `twin info` raise what it is given."""

    def install(error: BaseException) -> None:
        @click.command()
        def command() -> None:
            raise error

        monkeypatch.setitem(sys.modules, "twin.cli.info", types.SimpleNamespace(command=command))

    return install


def test_version_and_help(capsys):
    assert main.run(["--version"]) == 0
    assert __version__ in capsys.readouterr().out
    assert main.run(["--help"]) == 0
    text = capsys.readouterr().out
    assert all(name in text for name in main.COMMANDS)
    assert "Example:" in text


@pytest.mark.parametrize("name", main.COMMANDS)
def test_every_command_exists_and_its_help_ends_with_an_example(name, capsys):
    assert main.run([name, "--help"]) == 0
    assert f"Example: twin {name}" in " ".join(capsys.readouterr().out.splitlines()[-3:])


def test_unknown_command_names_the_nearest(capsys):
    assert main.run(["chek"]) == 2
    assert "did you mean 'check'?" in capsys.readouterr().err


def test_twin_errors_are_one_block_without_traceback(failing, capsys):
    failing(
        DescriptionError.collect(
            [Problem("a is wrong", "m.toml: a", "fix a"), Problem("b is wrong", "m.toml: b", "fix b")]
        )
    )
    assert main.run(["info"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err == "error: m.toml: a: a is wrong\n    remedy: fix a\nm.toml: b: b is wrong\n    remedy: fix b\n"


def test_traceback_on_demand(failing, capsys):
    failing(DescriptionError("a is wrong", "m.toml", "fix a"))
    assert main.run(["--traceback", "info"]) == 2
    assert "Traceback" in capsys.readouterr().err


def test_an_interrupt_leaves_nothing_half_written(failing, capsys):
    failing(KeyboardInterrupt())
    assert main.run(["info"]) == 130
    assert "interrupted, nothing half-written" in capsys.readouterr().err


def test_a_full_disk_is_told_with_its_remedy(failing, capsys):
    failing(OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "A.h5"))
    assert main.run(["info"]) == 2
    assert capsys.readouterr().err == (
        "error: A.h5: No space left on device\n"
        "    remedy: free disk space or choose another folder; nothing half-written was left\n"
    )


def test_missing_package_names_the_extra(failing, capsys):
    failing(ModuleNotFoundError("No module named 'skfem'", name="skfem"))
    assert main.run(["info"]) == 2
    assert "pip install 'twin[build]'" in capsys.readouterr().err


def test_own_mistakes_are_not_hidden(failing):
    failing(ZeroDivisionError())
    with pytest.raises(ZeroDivisionError):
        main.run(["info"])


def test_help_is_fast_and_imports_no_command():
    code = (
        "import sys; from twin.cli.main import run; run(['--help']); "
        "sys.exit(any(m in sys.modules for m in ('numpy', 'jax', 'pydantic', 'skfem', 'pint')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False, stdout=subprocess.DEVNULL).returncode == 0


@pytest.mark.parametrize(("given", "expected"), [(None, "1"), ("4", "4")])
def test_run_sets_blas_threads_before_numpy_unless_told_otherwise(given, expected):
    code = (
        "import os, sys; from twin.cli.main import run; assert 'numpy' not in sys.modules; run(['run', '--help']); "
        f"sys.exit(os.environ['OPENBLAS_NUM_THREADS'] != '{expected}')"
    )
    env = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"} | (
        {"OPENBLAS_NUM_THREADS": given} if given else {}
    )
    assert subprocess.run([sys.executable, "-c", code], env=env, check=False, stdout=subprocess.DEVNULL).returncode == 0
