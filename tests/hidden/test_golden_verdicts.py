"""Diagnoses of stored trials are the stored ones: verdicts, causes, sizes, statistics, thresholds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.golden import verdicts
from tests.golden.compare import differences
from tests.golden.compute import Values
from tests.hidden.found import QUICK, Said, made_detector

GOLDEN: dict[str, Any] = json.loads((Path(verdicts.__file__).parent / "verdicts.json").read_text(encoding="utf-8"))
TOLERANCE = 1e-9  # of each quantity's own scale

pytestmark = [pytest.mark.long, pytest.mark.xdist_group("trials")]


def compare(studied: str, found: Values) -> None:
    golden = {name: value for name, value in GOLDEN.items() if name.startswith(f"{studied}.")}
    wrong = differences(golden, found, TOLERANCE)
    assert not wrong, "\n" + "\n".join(wrong)


@pytest.fixture(autouse=True)
def _quick(settings):
    if settings is not QUICK:
        pytest.skip("stored are those of `make test-hidden`, with few synthetic measurements")


@pytest.mark.parametrize("name", verdicts.TRIALS)
def test_the_diagnosis_of_a_trial_is_the_stored_one(everything: dict[str, Said], name: str) -> None:
    compare(f"trials.{name}", verdicts.trial_values(name, everything[name]))


def test_thresholds_are_the_stored_ones() -> None:
    compare("trials.thresholds", verdicts.threshold_values(made_detector(QUICK)))


def test_diagnoses_of_a_lumped_machine_are_the_stored_ones(tmp_path: Path) -> None:
    compare("lumped", verdicts.lumped_values(tmp_path))


def test_something_is_hidden_in_most_and_nothing_in_some() -> None:
    said = {name: value for name, value in GOLDEN.items() if name.endswith(".verdict")}
    assert len(said) >= 12
    assert list(said.values()).count("nothing") >= 3
    assert any(name.startswith("lumped.") for name in said)
