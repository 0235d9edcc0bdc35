"""No function decides more than twenty times: ruff's C901 counts statements alone, and one line may hold ten decisions.

Counted as radon does: one, and one for every branch, loop, handler, condition of a comprehension, `and` and `or`, those
of inner functions among them. An assertion is no branch.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MOST = 20
FREE = "twin/diagnose/"


def decisions(node: ast.AST) -> int:
    """Decisions in a node, itself included."""
    own = 0
    if isinstance(node, ast.If | ast.IfExp | ast.ExceptHandler | ast.match_case | ast.FunctionDef):
        own = 1
    elif isinstance(node, ast.For | ast.While | ast.Try):
        own = (not isinstance(node, ast.Try)) + bool(node.orelse)
    elif isinstance(node, ast.BoolOp):
        own = len(node.values) - 1
    elif isinstance(node, ast.comprehension):
        own = 1 + len(node.ifs)
    return own + sum(decisions(child) for child in ast.iter_child_nodes(node))


def complexities(text: str) -> Iterator[tuple[str, int]]:
    """Name and line of every function, and its complexity."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            yield f"{node.name} in line {node.lineno}", decisions(node)


def test_decisions_are_counted_where_ruff_sees_one_line():
    condition = "    if x and x[0] or not x:\n        return [y for y in x if y > 0 if y < 9]\n"
    text = f"def f(x):\n{condition}    return 0 if x else 1\n"
    assert dict(complexities(text)) == {"f in line 1": 1 + (1 + 2) + 3 + 1}


@pytest.mark.parametrize("folder", ["twin", "benchmarks", "models", "notebooks", "tests"])
def test_no_function_is_too_complex_to_hold_in_mind(folder):
    told = []
    for path in sorted((ROOT / folder).rglob("*.py")):
        name = path.relative_to(ROOT).as_posix()
        if not name.startswith(FREE):
            found = complexities(path.read_text("utf-8"))
            told += [f"{name}: {function} has {n}" for function, n in found if n > MOST]
    assert not told, "split along its ideas:\n" + "\n".join(told)
