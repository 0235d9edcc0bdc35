"""What may be said of additional films, and which surfaces they take."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.support import descriptions, lumped
from twin.errors import DescriptionError
from twin.machine.description import BOX_SURFACES
from twin.machine.load import load_machine
from twin.machine.surfaces import film_surfaces

DRAUGHT = (
    '\n[films.draught]\nlaw = "constant_film"\nadditional = true\nenvironment = "shop"\n'
    'parameters = { natural = "5 W/(m^2*K)" }\n'
)


def slide(folder: Path, more: str):
    path = folder / "machine.toml"
    path.write_text(descriptions.SLIDE.read_text(encoding="utf-8") + DRAUGHT + more, encoding="utf-8")
    return load_machine(path)


def refused(folder: Path, more: str) -> list[str]:
    with pytest.raises(DescriptionError) as e:
        slide(folder, more)
    return [f"{re.sub('.*: | .line.*', '', p.where)}: {p.what}" for p in e.value.problems]


def test_other_films_keep_their_surfaces(tmp_path):
    before = load_machine(descriptions.SLIDE)
    machine = slide(tmp_path, 'surfaces = ["bed.x_min", "bed.z_max", "foot_1.z_min", "bed.x_min"]')
    names = dict.fromkeys(machine.parts, BOX_SURFACES)
    films = film_surfaces(machine, names)
    assert films.pop("draught") == (("bed", "x_min"), ("bed", "z_max"), ("foot_1", "z_min"))
    assert films == film_surfaces(before, names)


def test_it_accounts_for_no_surface(tmp_path):
    """What has no other film, contact or adiabatic list is still reported."""
    machine = slide(tmp_path, 'surfaces = ["plate.x_min"]')
    films = {**machine.films, "moving": machine.films["moving"].model_copy(update={"surfaces": ("slide.*",)})}
    with pytest.raises(DescriptionError, match=r"surface 'plate\.x_min' belongs to no film"):
        film_surfaces(machine.model_copy(update={"films": films}), dict.fromkeys(machine.parts, BOX_SURFACES))


def test_stars_and_radiation_are_refused(tmp_path):
    (star,) = refused(tmp_path, 'surfaces = ["bed.*"]')
    assert star == "films.draught.surfaces: '*' stands for surfaces in films only, not in additional ones"
    (painted,) = refused(tmp_path, 'surfaces = ["bed.x_min"]\nemissivity = 0.9')
    assert painted == "films.draught.emissivity: an additional film does not radiate"
    (seen,) = refused(tmp_path, 'surfaces = ["bed.x_min"]\nradiant = "floor"')
    assert seen == "films.draught.radiant: an additional film does not radiate"
    assert slide(tmp_path, 'surfaces = ["bed.x_min"]\nemissivity = 0.0').films["draught"].additional


def test_a_body_of_nodes_needs_another_film(tmp_path):
    alone = lumped.HEAD + "\n[nodes.a]\ncapacity = 1000\narea = 0.1\n" + lumped.film("air", "a", 5.0)
    path = lumped.write(tmp_path, head=alone)
    assert load_machine(path).films["air"].area is None
    path.write_text(alone + "additional = true\n", encoding="utf-8")
    with pytest.raises(DescriptionError, match="no film cools a"):
        load_machine(path)
