"""Which bodies move with which axis, and where to."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from twin.errors import DescriptionError
from twin.machine.description import Axis, Box, Contact, Machine, Part, Support
from twin.machine.kinematics import direction, displacement, linear_axes, moved_bodies, rail_moves
from twin.machine.load import load_machine

SLIDE = load_machine(Path(__file__).parents[1] / "machines" / "slide")


def five_axis() -> Machine:
    """Bed - X - column - Y - head, and bed - Z - table with a rotary axis: the chain of paper 000, in blocks."""
    block = Part(material="steel", box=Box(origin=(0, 0, 0), size=(1, 1, 1), divisions=(1, 1, 1)))

    def guide(axis: str, rail: str, pad: str) -> Contact:
        return Contact(kind="moving", axis=axis, pairs=((f"{rail}.z_max", f"{pad}.z_min"),), conductance=1.0)

    return SLIDE.model_copy(
        update={
            "parts": dict.fromkeys(("bed", "column", "head", "table", "cover"), block),
            "axes": {
                "X": Axis(direction=(2, 0, 0), stroke=(-0.4, 0.4), carries=("column",), position="x_position"),
                "Y": Axis(direction=(0, 0, 1), stroke=(-0.4, 0.4), carries=("head",), position="x_position"),
                "Z": Axis(direction=(0, -1, 0), stroke=(-0.4, 0.4), carries=("table",), position="x_position"),
                "B": Axis(kind="rotary", direction=(0, 0, 1), carries=("table",), position="x_position"),
            },
            "contacts": {
                "x": guide("X", "bed", "column"),
                "y": guide("Y", "head", "column"),  # the rail is on the moving side
                "z": guide("Z", "bed", "table"),
                "cover": Contact(kind="fixed", surfaces=("head.x_max", "cover.x_min"), conductance=1.0),
            },
            "supports": {"foot": Support(surface="bed.z_min", stiffness=(1.0, 1.0, 1.0))},
        }
    )


def test_axes_carry_what_stands_on_what_they_carry():
    machine = five_axis()
    assert linear_axes(machine) == ("X", "Y", "Z")
    assert moved_bodies(machine, "X") == {"column", "head"}
    assert moved_bodies(machine, "Y") == {"head"}
    assert moved_bodies(machine, "Z") == {"table"}


def test_displacements_add_up_along_the_chain():
    machine = five_axis()
    at = {"X": 0.1, "Y": 0.2, "Z": 0.3}
    np.testing.assert_allclose(displacement(machine, "bed", at), [0, 0, 0])
    np.testing.assert_allclose(displacement(machine, "column", at), [0.1, 0, 0])
    np.testing.assert_allclose(displacement(machine, "head", at), [0.1, 0, 0.2])
    np.testing.assert_allclose(displacement(machine, "cover", at), [0.1, 0, 0.2])  # a part speaks for its body
    np.testing.assert_allclose(displacement(machine, "table", at), [0, -0.3, 0])
    np.testing.assert_allclose(displacement(machine, "head", {"Y": -0.2}), [0, 0, -0.2])


def test_the_side_that_moves():
    machine = five_axis()
    assert rail_moves(machine, "X", "bed.z_max", "column.z_min") is False
    assert rail_moves(machine, "Y", "head.z_max", "column.z_min") is True


def test_directions_are_normalised():
    np.testing.assert_allclose(direction(five_axis(), "X"), [1, 0, 0])
    still = five_axis().model_copy(update={"axes": {"X": SLIDE.axes["x"].model_copy(update={"direction": (0, 0, 0)})}})
    with pytest.raises(DescriptionError, match="no length"):
        direction(still, "X")


def test_an_axis_that_would_move_the_ground_is_refused():
    machine = five_axis()
    wrong = machine.model_copy(
        update={"axes": {**machine.axes, "X": machine.axes["X"].model_copy(update={"carries": ("bed",)})}}
    )
    with pytest.raises(DescriptionError, match=r"axis 'X' moves the body that stands on supports\.foot"):
        moved_bodies(wrong, "X")


def test_pads_on_the_same_side_as_their_rail_are_refused():
    with pytest.raises(DescriptionError, match="both move"):
        rail_moves(five_axis(), "X", "column.z_max", "head.z_min")
    with pytest.raises(DescriptionError, match="both stand still"):
        rail_moves(five_axis(), "X", "bed.z_max", "table.z_min")


def test_unknown_axes_and_bodies_are_refused():
    with pytest.raises(DescriptionError, match="'B' is not a linear axis"):
        displacement(five_axis(), "bed", {"B": 0.1})
    with pytest.raises(DescriptionError, match="unknown part 'spindle'"):
        displacement(five_axis(), "spindle", {})
