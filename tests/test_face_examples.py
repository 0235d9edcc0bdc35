"""The examples in the docstrings of the Python face and in docs/python.md are run, and their values compared."""

from __future__ import annotations

import doctest
import re
from pathlib import Path

import pytest

import twin

ROOT = Path(__file__).parents[1]
QUICK = ("load", "check", "read", "build", "run", "simulate", "score", "update", "rtest", "hide")
SLOW = ("calibrate", "diagnose")


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """A folder like the root of the repository, whose out/ is ours."""
    for name in ("tests", "models"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)


def executed(text: str, name: str) -> int:
    """Run the examples of a text in order; returns how many there were. Fails where a value is another."""
    test = doctest.DocTestParser().get_doctest(text, {}, name, name, 0)
    told: list[str] = []
    result = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(test, out=told.append)
    assert result.failed == 0, "".join(told)
    return result.attempted


@pytest.mark.parametrize("name", [*QUICK, *(pytest.param(n, marks=pytest.mark.slow) for n in SLOW)])
def test_the_example_of_a_function_does_what_it_says(name, repository):
    assert executed(getattr(twin, name).__doc__, f"twin.{name}") >= 2


def test_an_example_with_another_value_fails():
    with pytest.raises(AssertionError, match="Expected"):
        executed(">>> 1 + 1\n3\n", "wrong")


def recipes() -> dict[str, str]:
    """The code of each recipe of docs/python.md, by its heading."""
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    found = {}
    for part in text.split("\n## ")[1:]:
        code = "\n".join(re.findall(r"```python\n(.*?)```", part, re.DOTALL))
        if code:
            found[part.splitlines()[0]] = code
    return found


@pytest.mark.slow
def test_the_recipes_run_in_their_order(repository):
    assert len(recipes()) == 10
    names: dict[str, object] = {}
    for title, code in recipes().items():
        exec(compile(code, title, "exec"), names)
