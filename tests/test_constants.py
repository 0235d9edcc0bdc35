"""Tests assert behaviour and order: none takes over a number that somebody tuned."""

from __future__ import annotations

import ast
import importlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).parent
GIVEN = (
    "twin.physics",  # constants of nature and of published correlations
    "twin.inject",  # how synthetic experiments are made: an input of every result, fitted to none
)
PUBLISHED = {
    "twin.rom.following.DIFFERENCES": "nodes of film tables: tests compute laws there",
    "twin.units._TABLE": "factors to SI units: a test reads a number in every one of them",
}
# Bounds of memory and work: a test makes them small, that a small case has several portions, or is made quickly
PATCHED = {
    "AT_ONCE": "columns that are stepped together",
    "CHUNK": "elements that are assembled together",
    "_CHUNK": "pixels that are drawn together",
    "MAX_ITERATIONS": "after which a solver that stalls says so",
    "DRAWS": "trajectories that the reduced machine of trials is made from",
    "RICH": "its rich basis",
    "STATES": "its states at most",
    "MOST": "nodes of a surface that a tank is connected to; positions of which a model keeps all TCP rows",
}


def is_number(value: object) -> bool:
    """Whether a value is a number, or holds nothing else."""
    if isinstance(value, dict):
        return bool(value) and all(is_number(v) for v in value.values())
    if isinstance(value, (tuple, list, set, frozenset)):
        return bool(value) and all(is_number(v) for v in value)
    if isinstance(value, np.ndarray):
        return value.dtype.kind in "iufc"
    return isinstance(value, (int, float, complex, np.number)) and not isinstance(value, bool)


def is_constant(name: str) -> bool:
    return name.isupper()


def dotted(node: ast.expr) -> str:
    """`a.b.c` of an expression, empty where it is none."""
    if isinstance(node, ast.Name):
        return node.id
    head = dotted(node.value) if isinstance(node, ast.Attribute) else ""
    return f"{head}.{node.attr}" if head and isinstance(node, ast.Attribute) else ""


def names_of(tree: ast.AST) -> dict[str, str]:
    """What a test imports from twin, under its own names -> full names."""
    found = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for a in node.names:
                if a.name.split(".")[0] == "twin":
                    found[a.asname or "twin"] = a.name if a.asname else "twin"
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "twin":
            for a in node.names:
                found[a.asname or a.name] = f"{node.module}.{a.name}"
    return found


@cache
def taken(text: str) -> tuple[str, ...]:
    """Full names of the numbers that a test takes from twin: imported, or read from a module."""
    tree = ast.parse(text)
    names = names_of(tree)
    candidates = [name for name in names.values() if is_constant(name.rpartition(".")[2])]
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and is_constant(node.attr):
            head, *rest = dotted(node).split(".")
            if head in names:
                candidates.append(".".join([names[head], *rest]))
    return tuple(name for name in candidates if not name.startswith(GIVEN) and is_number(value_of(name)))


@cache
def value_of(name: str) -> object:
    """What a full name stands for, None where it is none of a module."""
    module, _, own = name.rpartition(".")
    try:
        return getattr(importlib.import_module(module), own, None)
    except ModuleNotFoundError:
        return None


def patched(text: str) -> Iterator[str]:
    """Names of constants that a test sets by `monkeypatch.setattr`."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "setattr":
            for given in node.args[:2]:
                if isinstance(given, ast.Constant) and isinstance(given.value, str):
                    name = given.value.rpartition(".")[2]
                    if is_constant(name):
                        yield name


def files() -> list[Path]:
    return sorted(HERE.rglob("*.py"))


def test_no_test_takes_a_tuned_number():
    found = {
        f"{path.relative_to(HERE).as_posix()}: {name}"
        for path in files()
        for name in taken(path.read_text(encoding="utf-8"))
        if name not in PUBLISHED
    }
    assert not found, "assert behaviour or order instead, or state a documented number with its source"


def test_no_test_sets_a_tuned_number():
    found = {
        f"{path.relative_to(HERE).as_posix()}: {name}"
        for path in files()
        for name in patched(path.read_text(encoding="utf-8"))
        if name not in PATCHED
    }
    assert not found, "choose a case that shows the rule instead"


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("from twin.build.tanks import MOST", ["twin.build.tanks.MOST"]),
        ("import twin.build.tanks\ntwin.build.tanks.MOST", ["twin.build.tanks.MOST"]),
        ("import twin.build.tanks as t\nt.MOST", ["twin.build.tanks.MOST"]),
        ("from twin.build import tanks as t\nprint(t.MOST)", ["twin.build.tanks.MOST"]),
        ("from twin.calibrate.score.regression import STRENGTHS", ["twin.calibrate.score.regression.STRENGTHS"]),
        ("from twin.physics.laws import LAWS", []),
        ("from twin.diagnose.faults.catalogue import FAMILIES", []),
        ("from tests.diagnose.small_case import HOURS", []),
    ],
)
def test_numbers_are_told_from_tables_and_names(text, wanted):
    assert list(taken(text)) == wanted


def test_constants_that_are_set_are_seen():
    text = 'monkeypatch.setattr(module, "LIMIT", 3)\nmonkeypatch.setattr("twin.a.SIZE", 3)\nm.setattr(os, "replace", f)'
    assert list(patched(text)) == ["LIMIT", "SIZE"]


def test_every_exception_is_needed():
    texts = [path.read_text(encoding="utf-8") for path in files()]
    assert {name for text in texts for name in taken(text)} == set(PUBLISHED)
    assert {name for text in texts for name in patched(text)} == set(PATCHED)
