"""Bodies: what fixed contacts join."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.errors import DescriptionError
from twin.machine.bodies import Body, bodies_of, body_of, split_surface
from twin.machine.description import Contact, Machine
from twin.machine.load import load_machine

SLIDE = load_machine(Path(__file__).parents[1] / "machines" / "slide")


def with_contacts(**contacts: Contact) -> Machine:
    return SLIDE.model_copy(update={"contacts": {**SLIDE.contacts, **contacts}})


def test_parts_joined_through_others_are_one_body():
    bodies = bodies_of(SLIDE)
    assert bodies == (
        Body("bed", ("bed", "foot_1", "foot_2", "foot_3", "rail_1", "rail_2", "block", "screw")),
        Body("slide", ("slide", "pad_1", "pad_2", "pad_3", "pad_4", "nut", "plate")),
    )
    assert body_of(bodies, "screw") is bodies[0]


def test_the_order_of_contacts_does_not_matter():
    turned = SLIDE.model_copy(update={"contacts": dict(reversed(SLIDE.contacts.items()))})
    assert bodies_of(turned) == bodies_of(SLIDE)


def test_one_more_fixed_contact_joins_all():
    joined = with_contacts(clamp=Contact(kind="fixed", surfaces=("plate.x_min", "foot_3.x_max"), conductance=1.0))
    assert [b.name for b in bodies_of(joined)] == ["bed"]


def test_unknown_parts_are_refused():
    with pytest.raises(DescriptionError, match=r"unknown part in 'colum\.top'") as e:
        bodies_of(with_contacts(clamp=Contact(kind="fixed", surfaces=("colum.top", "bed.x_max"), conductance=1.0)))
    assert e.value.problems[0].where == "contacts.clamp.surfaces"
    with pytest.raises(DescriptionError, match="unknown part 'colum'"):
        body_of(bodies_of(SLIDE), "colum")


def test_surfaces_are_split_at_the_first_dot():
    assert split_surface("bed.top.left") == ("bed", "top.left")
    for wrong in ("bed", "bed.", ".top"):
        with pytest.raises(DescriptionError, match="is not a surface"):
            split_surface(wrong)
