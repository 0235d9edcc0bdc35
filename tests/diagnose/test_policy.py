"""Numbers that decide stand once, with what they are and where they come from."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path

import pytest

from tests.diagnose import small_case
from twin.diagnose.search.limits import limits_at
from twin.diagnose.search.look import look
from twin.diagnose.search.policy import POLICY, Origin, rules

SEARCH = Path(__file__).parents[2] / "twin" / "diagnose" / "search"
# what a detector is made by, and how finely edges in time are differentiated: no search decides by these
APART = {"detector.py", "edges.py", "policy.py"}


def numbers(text: str) -> list[str]:
    """Names of a module's constants that are numbers, or several."""
    found = []
    for node in ast.parse(text).body:
        if isinstance(node, ast.Assign) and not isinstance(node.value, ast.Call):
            values = [n for n in ast.walk(node.value) if isinstance(n, ast.Constant)]
            if values and all(isinstance(n.value, int | float) for n in values):
                found += [n.id for target in node.targets for n in ast.walk(target) if isinstance(n, ast.Name)]
    return found


def test_every_number_says_what_it_is_and_where_it_comes_from():
    assert len({name for name, *_ in rules()}) == len(rules())
    for name, value, _, origin, meaning in rules():
        assert isinstance(value, int | float), name
        assert isinstance(origin, Origin), name
        assert len(meaning) > 8, name


def test_no_number_of_a_search_stands_elsewhere():
    found = {p.name: numbers(p.read_text("utf-8")) for p in SEARCH.glob("*.py") if p.name not in APART}
    assert not {name: own for name, own in found.items() if own}


@pytest.mark.parametrize(
    ("text", "wanted"),
    [("A = 3", ["A"]), ("A, B = 1.0, 5e-6", ["A", "B"]), ('A = "x"', []), ("A = f(3)", []), ("A = (1, 2)", ["A"])],
)
def test_numbers_are_seen(text, wanted):
    assert numbers(text) == wanted


@pytest.mark.long
def test_a_policy_is_handed_down():
    """A limit follows from the power that is asked for."""
    detector = small_case.made_detector()
    surer = replace(detector, policy=replace(POLICY, power=2.0 * POLICY.power))
    before, after = limits_at(detector), limits_at(surer)
    assert all(after[key] >= before[key] for key in before)
    assert sum(after[key] > before[key] for key in before) > 0.5 * len(before)
    y = small_case.made_detector().fitter.surrogate.y0
    assert len(look(surer, surer.fitter(y))[1]) > 0
