"""Diagnoses of stored trials are the stored ones: verdicts, causes, sizes, statistics, thresholds. Minutes long."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from tests.golden.compare import differences
from tests.golden.pinned import computed

GOLDEN: dict[str, Any] = json.loads((Path(__file__).parent / "verdicts.json").read_text(encoding="utf-8"))
STUDIED = sorted({".".join(name.split(".")[:2]) for name in GOLDEN})  # "trials.null_0", "lumped.heat", ...
TOLERANCE = 1e-9  # of each quantity's own scale

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def now() -> dict[str, Any]:
    """With the null distribution of tests/hidden, where the cache of the tests has it already."""
    return dict(computed("tests.golden.verdicts", Path(os.environ["TWIN_CACHE"])))


@pytest.mark.parametrize("studied", STUDIED)
def test_a_diagnosis_is_the_stored_one(now: dict[str, Any], studied: str) -> None:
    golden, found = (
        {name: value for name, value in values.items() if name.startswith(f"{studied}.")} for values in (GOLDEN, now)
    )
    wrong = differences(golden, found, TOLERANCE)
    assert not wrong, "\n" + "\n".join(wrong)


def test_something_is_hidden_in_most_and_nothing_in_some() -> None:
    verdicts = {name: value for name, value in GOLDEN.items() if name.endswith(".verdict")}
    assert len(verdicts) >= 12
    assert list(verdicts.values()).count("nothing") >= 3
    assert any(name.startswith("lumped.") for name in verdicts)
