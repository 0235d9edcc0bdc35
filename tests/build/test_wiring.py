"""The LoadModel of a machine: SI numbers and certified ranges."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from twin.build.mesh import load_body_meshes
from twin.build.ports import contact_ports
from twin.build.wiring import film_range, load_model
from twin.errors import DescriptionError
from twin.machine.load import load_machine
from twin.rom.load_model import EnvironmentWiring, Film, LawUse, LoadModel, Signal

SLIDE = load_machine(Path(__file__).parents[1] / "machines" / "slide")
AREAS = {"structure": 1.0, "moving": 0.5, "floor": 0.1}
LOAD = load_model(SLIDE, contact_ports(SLIDE, load_body_meshes(SLIDE)), AREAS)
ROOM = (EnvironmentWiring("room", "", 20.0),)


def range_of(use, signals, emissivity=0.0):
    return film_range(Film("a", use, 0, 0.0, 0.0, 1.0, emissivity), ROOM, signals, "films.a")


def test_signals_and_axes_are_in_si():
    by_name = {s.name: s for s in LOAD.signals}
    assert by_name["x_position"] == Signal("x_position", "x_position", "m", "value", -0.2, 0.2)
    assert by_name["x_current"].column == "x_motor_current"
    assert (by_name["x_speed"].unit, by_name["x_speed"].high) == ("m/s", 0.5)
    assert (LOAD.axes[0].name, LOAD.axes[0].low, LOAD.axes[0].high) == ("x", -0.2, 0.2)
    assert LOAD.environments == (EnvironmentWiring("shop", "shop_air", 20.0), EnvironmentWiring("floor", "", 19.0))


def test_laws_have_their_parameters_in_si_and_defaults_filled_in():
    by_name = {s.name: s for s in LOAD.sources}
    assert by_name["x_guide"].use.parameters == {"friction": 0.0015, "load": 2000.0, "seal_drag": 40.0}
    assert by_name["x_nut"].use.parameters["diameter"] == pytest.approx(0.02)
    assert by_name["x_nut"].contact == "x_screw"
    assert by_name["x_motor"].contact == ""


def test_coefficients_are_films_then_joints_with_certified_ranges():
    assert LOAD.theta_names[:4] == ("films.structure", "films.moving", "films.floor", "contacts.foot_1.conductance")
    assert (LOAD.films[0].low, LOAD.films[0].high) == (3.0, 12.0)
    assert LOAD.films[1].low == pytest.approx(0.5 * (6 + 3.6), rel=0.01)  # at rest, though the ends of the range move
    assert LOAD.films[1].high == pytest.approx(2 * (6 + 20 * 0.5**0.8 + 7.55), rel=0.01)
    assert (LOAD.joints[0].low, LOAD.joints[0].high) == pytest.approx((2000 / 3, 6000))


def test_film_ranges_look_at_every_corner():
    use = LawUse("forced_film", {"natural": 5.0, "forced": 10.0, "exponent": 1.0}, {"speed": "v"})
    assert range_of(use, {"v": Signal("v", "v", "m/s", "value", 1.0, 3.0)}) == (7.5, 70.0)
    assert range_of(use, {"v": Signal("v", "v", "m/s", "value", -3.0, 1.0)}) == (2.5, 70.0)
    with pytest.raises(DescriptionError, match=r"gives 5 \.\. inf") as e:
        range_of(use, {"v": Signal("v", "v", "m/s", "value", 0.0, np.inf)})
    assert e.value.problems[0].where == "films.a"
    without_natural_part = LawUse("forced_film", {"natural": 0.0, "forced": 10.0}, {"speed": "v"})
    with pytest.raises(DescriptionError, match=r"gives 0 \.\. 30") as e:
        range_of(without_natural_part, {"v": Signal("v", "v", "m/s", "value", 0.0, 3 ** (1 / 0.8))})
    assert "adiabatic" in e.value.problems[0].remedy


def test_film_ranges_hold_radiation_and_free_convection():
    still = LawUse("constant_film", {"natural": 5.0}, {})
    low, high = range_of(still, {}, emissivity=0.9)
    assert 0.5 * (5.0 + 3.7) < low < 0.5 * (5.0 + 3.8)  # 60 K colder than the room
    assert 2.0 * (5.0 + 6.9) < high < 2.0 * (5.0 + 7.2)
    free = LawUse("free_vertical_plate", {"height": 0.5}, {})
    low, high = range_of(free, {})
    assert 0.1 < low < 0.6 < 2.0 * 5.0 < high < 2.0 * 8.0


def test_the_load_model_survives_json():
    assert LoadModel.from_json(json.loads(json.dumps(LOAD.to_json()))) == LOAD
