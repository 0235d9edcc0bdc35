"""Defaults and factors of signals as the description states them, and how they reach the model."""

from __future__ import annotations

import math

import pytest

from tests.support.lumped import edited
from twin.errors import DescriptionError
from twin.machine.load import load_machine
from twin.machine.wiring import signal
from twin.rom.load_model import LoadModel, Signal


def wired(folder, *, of: str, more: str, unit: str = "", kind: str = "rms") -> Signal:
    texts = {"x_speed": 'unit = "m/min"', "spindle_current": 'unit = "A"\nkind = "rms"'}
    machine = load_machine(edited(folder, (texts[of], texts[of].replace("rms", kind) + "\n" + more)))
    return signal(of, machine.signals[of])


def test_a_default_is_in_the_signals_unit_or_in_its_own(tmp_path):
    assert wired(tmp_path, of="x_speed", more="default = 12").default == pytest.approx(0.2)
    assert wired(tmp_path, of="x_speed", more='default = "-0.5 m/s"').default == -0.5
    assert wired(tmp_path, of="x_speed", more="factor = 60").factor == 60.0
    plain = wired(tmp_path, of="x_speed", more="")
    assert (plain.default, plain.factor) == (None, 1.0)


def test_a_default_of_a_peak_is_one(tmp_path):
    made = wired(tmp_path, of="spindle_current", more="default = 5.0", kind="peak")
    assert made.default == pytest.approx(5.0 / math.sqrt(2.0))
    assert made.high == pytest.approx(25.0 / math.sqrt(2.0))


@pytest.mark.parametrize(
    ("more", "where", "what"),
    [
        ("default = 40", "default", "outside the range"),
        ('default = "1 K"', "default", "'1 K'"),
        ("factor = 0", "factor", "a factor of zero"),
    ],
)
def test_what_cannot_be_is_refused(tmp_path, more, where, what):
    with pytest.raises(DescriptionError) as e:
        wired(tmp_path, of="x_speed", more=more)
    (problem,) = e.value.problems
    assert f"signals.x_speed.{where}" in problem.where
    assert what in problem.what


def test_artefacts_from_before_are_read():
    old = {"name": "a", "column": "a", "unit": "A", "kind": "rms", "low": 0.0, "high": 1.0}
    film = {"name": "f", "use": {"law": "constant_film", "parameters": {"natural": 5.0}, "signals": {}},
            "environment": 0, "low": 1.0, "high": 9.0}  # fmt: skip
    room = {"name": "room", "signal": "", "temperature": 20.0}
    empty = {key: [] for key in ("axes", "sources", "joints", "ports", "rails", "pairs")}
    load = LoadModel.from_json({**empty, "signals": [old], "films": [film], "environments": [room]})
    assert (load.signals[0].default, load.signals[0].factor) == (None, 1.0)
    assert (load.environments[0].switch, load.environments[0].switched_offset) == ("", 0.0)
    assert load.films[0].additional is False
    assert LoadModel.from_json(load.to_json()) == load
