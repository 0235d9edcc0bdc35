"""Every surface exchanges heat in exactly one way."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.errors import DescriptionError
from twin.machine.description import BOX_SURFACES, Machine
from twin.machine.load import load_machine
from twin.machine.surfaces import film_surfaces

SLIDE = load_machine(Path(__file__).parents[1] / "machines" / "slide")
NAMES = dict.fromkeys(SLIDE.parts, BOX_SURFACES)


def with_film(name: str, *surfaces: str) -> Machine:
    film = SLIDE.films[name].model_copy(update={"surfaces": surfaces})
    return SLIDE.model_copy(update={"films": {**SLIDE.films, name: film}})


def faults(machine: Machine) -> list[str]:
    with pytest.raises(DescriptionError) as e:
        film_surfaces(machine, NAMES)
    return [f"{p.where}: {p.what}" for p in e.value.problems]


def test_a_star_takes_what_nothing_else_uses():
    films = film_surfaces(SLIDE, NAMES)
    bed = [s for p, s in films["structure"] if p == "bed"]
    assert bed == ["x_min", "x_max", "y_min", "y_max"]  # z_min and z_max carry fixed contacts
    pads = [s for p, s in films["moving"] if p == "pad_1"]
    assert pads == ["x_min", "x_max", "y_min", "y_max"]  # z_max is glued, z_min adiabatic
    every = [pair for found in films.values() for pair in found]
    assert len(every) == len(set(every))


def test_a_named_surface_is_left_out_of_the_star_of_another_film():
    films = film_surfaces(with_film("floor", "foot_1.*", "foot_2.*", "foot_3.*", "bed.x_min"), NAMES)
    assert ("bed", "x_min") in films["floor"]
    assert ("bed", "x_min") not in films["structure"]


def test_surfaces_without_any_exchange_are_named():
    said = faults(with_film("floor", "foot_1.*", "foot_2.x_min", "foot_3.*"))
    assert said == [f"parts.foot_2: surface 'foot_2.{s}' belongs to no film" for s in ("x_max", "y_min", "y_max")]


def test_surfaces_with_two_uses_are_named():
    floor = with_film("floor", "foot_1.*", "foot_2.*", "foot_3.*", "foot_1.z_min", "bed.z_max")
    bed = floor.parts["bed"].model_copy(update={"adiabatic": ("z_max",)})
    said = faults(floor.model_copy(update={"parts": {**floor.parts, "bed": bed}}))
    assert said == [
        "parts.bed: surface 'bed.z_max' belongs to the adiabatic list and fixed contacts and films.floor",
        "parts.foot_1: surface 'foot_1.z_min' belongs to the adiabatic list and films.floor",
    ]


def test_two_stars_on_one_part_and_unknown_names_are_refused():
    said = faults(with_film("floor", "foot_1.*", "foot_2.*", "foot_3.*", "bed.*", "bed.top", "bad.*"))
    assert said == [
        "films.floor.surfaces: 'bed.*' is also in films.structure",
        "films.floor.surfaces: unknown surface 'bed.top'",
        "films.floor.surfaces: unknown part in 'bad.*'",
    ]


def test_a_film_may_name_what_fixed_contacts_leave_free():
    films = film_surfaces(with_film("floor", "foot_1.*", "foot_2.*", "foot_3.*", "bed.z_max"), NAMES)
    assert ("bed", "z_max") in films["floor"]
    assert ("bed", "z_min") not in films["structure"]  # "bed.*" does not take it
