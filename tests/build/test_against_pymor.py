"""The rich projection against pyMOR's on the same matrices (optional extra `compare`)."""

from __future__ import annotations

import pytest

from tests.system.conftest import SLIDE
from twin.build.pipeline import full_model
from twin.build.rich_basis import RichOptions
from twin.machine.load import load_machine

pytest.importorskip("pymor")


def test_same_transfer_function_as_pymor():
    from pymor.core.logger import set_log_levels

    from benchmarks.pymor import beside_pymor

    set_log_levels({"pymor": "ERROR"})
    model = full_model(load_machine(SLIDE)).thermal
    for body in model.bodies:
        result = beside_pymor(body, model.load_model, RichOptions(samples=4))
        assert result.states > 20
        assert result.difference < 1e-8
