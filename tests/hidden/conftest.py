"""Diagnoses of trials, made once for all tests that look at them."""

from __future__ import annotations

import pytest

from tests.hidden.found import QUICK, SETTINGS, Said, made_detector, said
from tests.hidden.trials import TRIALS
from twin.build.workers import each
from twin.diagnose.diagnose import Settings


@pytest.fixture(scope="session")
def settings(request: pytest.FixtureRequest) -> Settings:
    """Thresholds from many synthetic measurements where every test is asked for, from few otherwise."""
    return SETTINGS if "slow or" in request.config.getoption("markexpr") else QUICK


@pytest.fixture(scope="session")
def everything(request: pytest.FixtureRequest, settings: Settings) -> dict[str, Said]:
    """What is said of all trials that were asked for, two at a time."""
    items = [item for item in request.session.items if "everything" in getattr(item, "fixturenames", ())]
    asked = {item.callspec.params.get("name") for item in items if hasattr(item, "callspec")}
    names = [name for name in TRIALS if name in asked]
    made_detector(settings)
    return dict(zip(names, each(said, settings, names, long=0.0), strict=True))
