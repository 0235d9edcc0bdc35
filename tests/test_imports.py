"""Who imports whom beside the package: tests and benchmarks do not know each other, and the package knows neither."""

from __future__ import annotations

import ast
import importlib.util
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FORBIDDEN = {
    "tests": ("benchmarks",),
    "benchmarks": ("tests",),
    "models": ("tests", "benchmarks"),
    "twin": ("tests", "benchmarks", "models"),
}


def imported(text: str) -> Iterator[tuple[int, str]]:
    """(line, module) of all imports of a module's text, those within functions too."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.lineno, node.module


def offences(text: str, forbidden: tuple[str, ...]) -> list[str]:
    return [f"line {line}: {name}" for line, name in imported(text) if name.split(".")[0] in forbidden]


@pytest.mark.parametrize("folder", FORBIDDEN)
def test_imports_stay_on_their_side(folder):
    files = sorted((ROOT / folder).rglob("*.py"))
    assert files
    found = {str(path.relative_to(ROOT)): offences(path.read_text("utf-8"), FORBIDDEN[folder]) for path in files}
    assert not {path: lines for path, lines in found.items() if lines}


def test_an_import_within_a_function_is_found():
    text = "def f():\n    from benchmarks.pymor import clock\n\nimport tests.hidden as h\nimport testscripts\n"
    assert offences(text, ("benchmarks", "tests")) == ["line 4: tests.hidden", "line 2: benchmarks.pymor"]


@pytest.mark.parametrize("folder", ["benchmarks", "models"])
def test_what_no_test_runs_finds_its_names_in_the_package(folder):
    """A benchmark of hours would end at its first line."""
    missing = []
    for path in sorted((ROOT / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "twin":
                module = importlib.import_module(str(node.module))
                names = (alias.name for alias in node.names)
                missing += [
                    f"{path.name}:{node.lineno} {n}" for n in names
                    if not hasattr(module, n) and importlib.util.find_spec(f"{node.module}.{n}") is None
                ]  # fmt: skip
    assert not missing
