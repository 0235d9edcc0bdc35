"""Laws whose arguments travel in dataclasses are called by the single names of the fields."""

from __future__ import annotations

import inspect
from dataclasses import dataclass

import pytest

from twin.physics.grouped import Value, grouped


@dataclass(frozen=True)
class Wire:
    length: Value
    area: Value


@grouped
def heat(current, wire: Wire, resistivity):
    """R I^2 of a wire."""
    return resistivity * wire.length / wire.area * current**2


def test_fields_stand_in_the_signature_where_their_dataclass_stood():
    assert list(inspect.signature(heat).parameters) == ["current", "length", "area", "resistivity"]
    assert heat.__name__ == "heat"
    assert heat.__doc__ == "R I^2 of a wire."


def test_calls_by_position_and_by_name_agree():
    assert heat(2.0, 3.0, 0.5, 7.0) == 7.0 * 3.0 / 0.5 * 4.0
    assert heat(2.0, area=0.5, resistivity=7.0, length=3.0) == heat(2.0, 3.0, 0.5, 7.0)


@pytest.mark.parametrize(
    "named",
    [
        {"length": 3.0, "resistivity": 7.0},
        {"length": 3.0, "area": 0.5, "resistivity": 7.0, "wide": 1.0},
        {"wire": Wire(3.0, 0.5), "resistivity": 7.0},
        {"current": 1.0, "length": 3.0, "area": 0.5, "resistivity": 7.0},
    ],
    ids=["missing", "unknown", "the dataclass itself", "twice"],
)
def test_wrong_arguments_are_refused(named):
    with pytest.raises(TypeError):
        heat(2.0, **named)
