"""The examples in the docstrings of the Python face and in docs/python.md are run, and their values compared."""

from __future__ import annotations

import doctest
import re
from pathlib import Path

import pytest

import twin

ROOT = Path(__file__).parents[1]
BRIEF = ("load", "check", "simulate", "rtest", "hide")
LONG = ("build", "run", "read", "score", "update", "calibrate", "diagnose")


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


@pytest.mark.parametrize("name", [*BRIEF, *(pytest.param(n, marks=pytest.mark.long) for n in LONG)])
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


SMALL = {"models/five_axis": "tests/machines/spindle", "experiment_a": "warm_up", "4 h": "30 min"}


@pytest.mark.long
def test_the_lines_of_the_readme_run(repository):
    """On a small machine, in days that it is simulated in."""
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    for written, small in SMALL.items():
        assert written in code
        code = code.replace(written, small)
    machine, days = "tests/machines/spindle", {}
    for seed, day in enumerate(("monday", "tuesday", "wednesday")):
        noise = twin.SimulateOptions(noise="0.1 K", tcp_noise="1 um", seed=seed)
        days[day] = twin.simulate(machine, f"{machine}/runs/warm_up", f"out/{day}", noise)
    exec(compile(code, "README.md", "exec"), days)
    assert Path("out/report/report.json").is_file()
