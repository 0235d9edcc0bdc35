"""What is special about a family lives in `twin.diagnose.faults` and nowhere else."""

from __future__ import annotations

import ast
import pickle
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from twin.diagnose.faults.catalogue import FAMILIES
from twin.diagnose.faults.table import FAULTS

ROOT = Path(__file__).parents[2] / "twin" / "diagnose"
NAMES = frozenset({name for key in FAULTS for name in key} | {f.name for f in FAMILIES})
WHOLE = {"FAMILIES", "FAULTS"}  # the catalogue itself
OTHERS = r"(\w+\.)*(verdict|groups?|p\.kind|parameter\.kind)|.*\.parameters\[\w+\]\.kind"
LOOKUPS = ("get", "startswith", "removeprefix", "index", "count")


def tables(tree: ast.Module, names: frozenset[str]) -> set[str]:
    """Constants of a module that hold such names, and those that it imports from the faults."""
    found = set[str]()
    for node in tree.body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None and holds(node.value, names):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            found |= {target.id for target in targets if isinstance(target, ast.Name)}
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("twin.diagnose.faults"):
            found |= {alias.asname or alias.name for alias in node.names if alias.name.isupper()} - WHOLE
    return found


def holds(node: ast.AST, names: frozenset[str], known: set[str] | frozenset[str] = frozenset()) -> bool:
    return any(
        (isinstance(n, ast.Constant) and n.value in names) or (isinstance(n, ast.Name) and n.id in known)
        for n in ast.walk(node)
    )


def other(node: ast.AST) -> bool:
    """Whether a verdict, a group or a declared parameter is asked: their kinds have some of these names, too."""
    return any(re.fullmatch(OTHERS, ast.unparse(n)) for n in ast.walk(node) if isinstance(n, ast.Attribute | ast.Name))


def comparisons(text: str, names: frozenset[str] = NAMES) -> Iterator[tuple[int, str]]:
    """(line, code) of what compares with such a name, or looks something up by one."""
    tree = ast.parse(text)
    known = tables(tree, names)
    for node in ast.walk(tree):
        found = False
        if isinstance(node, ast.Compare):
            found = holds(node, names, known)
        elif isinstance(node, ast.Subscript) and getattr(node.value, "id", "") != "Literal":
            found = holds(node.slice, names) or getattr(node.value, "id", "") in known
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in LOOKUPS:
            found = getattr(node.func.value, "id", "") in known or any(holds(a, names) for a in node.args)
        elif isinstance(node, ast.match_case):
            found = holds(node.pattern, names, known)
        if found and not other(node):
            yield getattr(node, "lineno", 0), ast.unparse(node)


def everywhere() -> list[str]:
    return [
        f"{path.relative_to(ROOT)}:{line}: {code}"
        for path in sorted(ROOT.rglob("*.py"))
        if path.relative_to(ROOT).parts[0] != "faults"
        for line, code in comparisons(path.read_text("utf-8"))
    ]


def test_no_other_room_compares_the_name_of_a_family_or_kind():
    found = everywhere()
    assert not found, "ask the fault instead:\n" + "\n".join(found)


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ('h.family == "coolant"', 1), ('h.batch.kind in ("heat", "film")', 1), ('A = ("lag",)\nx in A', 1),
        ('T = {"sun": 1}\nT[f], T.get(f)', 2), ('d.verdict == "sensor"', 0), ('p.kind == "source"', 0),
        ('from twin.diagnose.faults.signal import LOST\nx in LOST', 1), ('group == "signal"', 0),
        ('"coolant"', 0), ('match k:\n    case "lag":\n        pass', 1), ('h.name == "other"', 0),
    ],
)  # fmt: skip
def test_comparisons_are_seen(text, count):
    assert len(list(comparisons(text))) == count


def test_the_catalogue_can_be_sent_to_another_process():
    again = pickle.loads(pickle.dumps(FAMILIES))
    assert [f.name for f in again] == [f.name for f in FAMILIES]
    assert all(a == b for a, b in zip(again, FAMILIES, strict=True))


def test_every_fault_belongs_to_its_family():
    assert {family for family, _ in FAULTS} | {"coarse_model", "missing_member"} == {f.name for f in FAMILIES}
    for (family, kind), fault in FAULTS.items():
        assert (fault.family, fault.kind) == (family, kind)
        assert fault.largest is None or fault.largest > fault.least
        assert fault.bare(f"{fault.prefix}a.b") == "a.b"
        assert not (fault.curved and not fault.read), kind
