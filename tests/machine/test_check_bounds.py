"""`twin check` evaluates every law at the bounds of its signals."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from tests.support.descriptions import SLIDE, edited
from twin.machine.check import check_machine
from twin.machine.load import load_machine
from twin.physics.laws import LAWS


def test_more_heat_than_a_machine_has_power_is_asked_about(tmp_path):
    path = edited(tmp_path, ("range = [0.0, 12.0]", "range = [0.0, 1200.0]"))
    (problem,) = check_machine(load_machine(path))
    assert problem.what == "at x_current 1200 the law 'motor_copper' gives 2.16e+06 W, which is much"
    assert problem.where == "machine.toml: sources.x_motor"
    assert "twin losses --explain sources.x_motor" in problem.remedy
    assert problem.warning


@pytest.mark.parametrize(
    ("name", "function", "what"),
    [
        (
            "motor_copper",
            lambda current, resistance: resistance / current,
            "at x_current 0 the law 'motor_copper' gives inf",
        ),
        (
            "forced_film",
            lambda speed, natural, forced, exponent: speed,
            "at x_speed -0.5 the law 'forced_film' gives -0.5 W/(m^2*K)",
        ),
        ("constant_film", lambda natural: np.nan * natural, "always, the law 'constant_film' gives nan"),
    ],
)
def test_what_no_run_could_use_is_an_error(monkeypatch, name, function, what):
    monkeypatch.setitem(LAWS, name, dataclasses.replace(LAWS[name], function=function, validity=None))
    problems = check_machine(load_machine(SLIDE))
    assert what in problems[0].what
    assert not any(p.warning for p in problems)
