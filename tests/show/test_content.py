"""What the page of a description holds: everything that is named, and what exchanges no heat, by hand."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.support.descriptions import MACHINES, SLIDE
from twin.build.interface import common_areas, interface
from twin.build.mesh import load_body_meshes
from twin.machine.load import load_machine
from twin.page.packed import unpacked
from twin.show.content import described_told

ROOT = Path(__file__).parents[2]
PLATE = (ROOT / "tests" / "machines" / "plate" / "machine.toml").read_text(encoding="utf-8")


def told_of(told: dict, group: str, name: str) -> dict:
    (entry,) = (e for e in told["entries"] if (e["group"], e["name"]) == (group, name))
    return entry


def facts(told: dict, group: str, name: str) -> dict[str, str]:
    return dict(told_of(told, group, name)["facts"])


@pytest.fixture(scope="module")
def slide() -> dict:
    return described_told(load_machine(SLIDE))


@pytest.mark.long
@pytest.mark.parametrize("path", MACHINES, ids=lambda p: p.parent.name)
def test_everything_named_is_in_the_list(path):
    machine = load_machine(path)
    told = described_told(machine)
    json.dumps(told, allow_nan=False)
    listed = {e["path"] for e in told["entries"]}
    for section in ("films", "sources", "sensors", "contacts", "supports", "tanks", "nodes", "bars"):
        assert {f"{section}.{name}" for name in getattr(machine, section)} <= listed
    moving = [c for c in machine.contacts.values() if c.kind == "moving"]
    assert {e["name"] for e in told["entries"] if e["group"] == "Rails"} == {r for c in moving for r, _ in c.pairs}
    assert {e["name"] for e in told["entries"] if e["group"] == "Pads"} == {p for c in moving for _, p in c.pairs}
    if machine.lumped:
        assert told["surface"] is None
        assert told["network"]["names"] == list(machine.members)
    else:
        assert set(told["surface"]["names"]) <= listed


def test_every_facet_is_drawn_on_its_surface(slide):
    surface = slide["surface"]
    of, triangles = unpacked(surface["of"]), unpacked(surface["triangles"])
    points = unpacked(surface["points"])
    for k, name in enumerate(surface["names"]):
        a, b, c = (points[triangles[of == k][:, i]].astype(float) for i in range(3))
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
        assert facts(slide, "Surfaces", name)["area"] == f"{area:.3g} m²"


def test_what_contacts_leave_free_is_uncovered(slide):
    """Bed of 0.8 m x 0.3 m: below three feet of 60 mm, above two rails of 0.8 m x 30 mm, a block of 50 mm x 60 mm."""
    below, above = 0.24 - 3 * 0.0036, 0.24 - 2 * 0.024 - 0.003
    line = next(t for t in slide["uncovered"] if " of bed," in t)
    assert line == f"uncovered: {below + above:.3g} m² of bed, adiabatic (z_min, z_max beside its fixed contacts)"
    assert facts(slide, "Uncovered", "bed")["z_min"].startswith(f"{below:.3g} m² of 0.24 m²")
    surface = slide["surface"]
    of, bare = unpacked(surface["of"]), unpacked(surface["bare"])
    names = surface["names"]
    assert bare[of == names.index("foot_1.z_min")].min() == 1.0  # listed as adiabatic
    assert bare[of == names.index("foot_1.z_max")].max() < 1e-6  # all of it on the bed
    assert bare[of == names.index("pad_1.z_min")].max() == 0.0  # listed as adiabatic, and a pad
    assert bare[of == names.index("bed.x_min")].max() == 0.0  # has a film


def test_a_face_left_out_is_uncovered_and_drawn_all_the_same(tmp_path):
    """The top of a plate of 0.5 m x 1 m in no film; its bottom is listed as adiabatic."""
    path = tmp_path / "machine.toml"
    left = ", ".join(f'"plate.{name}"' for name in ("x_min", "x_max", "y_min", "y_max"))
    path.write_text(PLATE.replace('surfaces = ["plate.*"]', f"surfaces = [{left}]"), encoding="utf-8")
    told = described_told(load_machine(path))
    assert told["uncovered"] == [
        "uncovered: 1 m² of plate, adiabatic (z_min listed as adiabatic; z_max in no film, contact or adiabatic list)"
    ]
    assert facts(told, "Surfaces", "plate.z_max")["uncovered"].startswith("0.5 m²")
    (problem,) = told["problems"]
    assert "surface 'plate.z_max' belongs to no film" in problem


def test_which_film_a_surface_has_and_why(tmp_path):
    path = tmp_path / "machine.toml"
    top = '\n[films.top]\nlaw = "constant_film"\nsurfaces = ["plate.z_max"]\nenvironment = "shop"\n'
    path.write_text(PLATE + top + 'parameters = { natural = "7 W/(m^2*K)" }\n', encoding="utf-8")
    told = described_told(load_machine(path))
    wanted = "top, which names it and so wins over plate.* of films.air"
    assert facts(told, "Surfaces", "plate.z_max")["film"] == wanted
    assert facts(told, "Surfaces", "plate.x_min")["film"] == "air, by plate.*: nothing else names this surface"
    assert facts(told, "Surfaces", "plate.z_min")["film"].startswith("none")
    film = told_of(told, "Films", "top")
    assert film["places"] == [told["surface"]["names"].index("plate.z_max")]
    assert dict(film["facts"])["natural"].startswith("7 W/(m^2*K)")
    assert dict(film["facts"])["area"] == "0.5 m²"


def test_a_rail_says_that_its_film_acts_under_the_pads(slide):
    assert "under the pads, too" in facts(slide, "Surfaces", "rail_1.z_max")["film"]
    assert facts(slide, "Rails", "rail_1.z_max")["pads"] == "pad_1.z_min, pad_2.z_min"


def test_an_axis_moves_what_it_carries(slide):
    (axis,) = slide["axes"]
    assert axis["stroke"] == [-0.2, 0.2]
    moves = dict(zip(slide["surface"]["bodies"], axis["moves"], strict=True))
    assert moves == {"bed": [0.0, 0.0, 0.0], "slide": [1.0, 0.0, 0.0]}


def test_common_areas_of_facets_add_up_to_the_interface():
    machine = load_machine(SLIDE)
    bodies = load_body_meshes(machine)
    for contact in machine.contacts.values():
        if contact.surfaces is None:
            continue
        body = next(b for b in bodies if any(p.name == contact.surfaces[0].split(".")[0] for p in b.parts))
        a, b = common_areas(body, *contact.surfaces, gap=contact.gap)
        area = interface(body, *contact.surfaces, gap=contact.gap).area
        assert (a.sum(), b.sum()) == pytest.approx((area, area), rel=1e-12)


def test_nothing_is_assembled(tmp_path):
    """What assembles and factorises is not even imported."""
    code = """if True:
        import sys
        from twin.cli.main import run
        status = run(sys.argv[1:])
        print(sorted({"twin.build.thermal", "twin.build.factorize", "twin.build.full_model"} & set(sys.modules)))
        sys.exit(status)"""
    command = [sys.executable, "-c", code, "show", str(SLIDE), "-o", str(tmp_path / "slide.html")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "[]"
