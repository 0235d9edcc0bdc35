"""Results of every stage are the stored ones: whatever is moved, renamed or merged, no number changes.

`python -m tests.golden.make` writes the values anew, where results are meant to change, and says which do.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.golden.compare import differences
from tests.golden.pinned import computed

GOLDEN: dict[str, Any] = json.loads((Path(__file__).parent / "values.json").read_text(encoding="utf-8"))
STAGES = sorted({".".join(name.split(".")[:2]) for name in GOLDEN})
TOLERANCE = 1e-12  # of each quantity's own scale


@pytest.fixture(scope="module")
def now(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Made from scratch: a cache of its own."""
    return dict(computed("tests.golden.compute", tmp_path_factory.mktemp("golden")))


def _of(values: dict[str, Any], stage: str) -> dict[str, Any]:
    return {name: value for name, value in values.items() if name.startswith(f"{stage}.")}


@pytest.mark.long
@pytest.mark.parametrize("stage", STAGES)
def test_every_number_of_a_stage_is_the_stored_one(now: dict[str, Any], stage: str) -> None:
    wrong = differences(_of(GOLDEN, stage), _of(now, stage), TOLERANCE)
    assert not wrong, "\n" + "\n".join(wrong)


@pytest.mark.long
def test_no_stage_is_new(now: dict[str, Any]) -> None:
    assert {".".join(name.split(".")[:2]) for name in now} == set(STAGES)


def test_a_number_off_by_more_than_the_tolerance_is_told() -> None:
    golden = {"a": {"values": [1.0, None, 200.0], "shape": [3], "scale": 200.0}, "b": "named"}
    near = {"a": {"values": [1.0 + 1e-10, None, 200.0], "shape": [3], "scale": 200.0}, "b": "named"}
    far = {"a": {"values": [1.0 + 1e-9, None, 200.0], "shape": [3], "scale": 200.0}, "b": "nothing"}
    gap = {"a": {"values": [1.0, 2.0, 200.0], "shape": [3], "scale": 200.0}, "c": 1}
    assert differences(golden, near, TOLERANCE) == []
    assert [line.split(":")[0] for line in differences(golden, far, TOLERANCE)] == ["a", "b"]
    assert differences(golden, gap, TOLERANCE) == ["b: is gone", "c: is new", "a: other numbers are missing"]
