"""Does a description fit its meshes? Each mistake as a user would make it, in real files."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

from tests.support.descriptions import SLIDE, edited
from twin.build.box_mesh import box_mesh
from twin.build.check_meshes import check_meshes, distance_to_part
from twin.build.mesh import load_part_mesh
from twin.machine.description import Box
from twin.machine.load import load_machine

PLATE_BOX = "box = { origin = [-0.06, -0.06, 0.20], size = [0.12, 0.12, 0.03], divisions = [3, 3, 1] }"


def write_plate(path: Path, scale: float = 1.0, empty: str = "", unnamed: str = "") -> None:
    """The slide's plate as a gmsh file: in other units, with a surface of no facets, or with facets of no surface."""
    mesh, surfaces = box_mesh(Box(origin=(-0.06, -0.06, 0.20), size=(0.12, 0.12, 0.03), divisions=(3, 3, 1)))
    names = list(surfaces)
    triangles = {n: mesh.facets[:, f].T for n, f in surfaces.items() if n != unnamed}
    field_data = {n: np.array([names.index(n) + 1, 2]) for n in triangles}
    if empty:
        field_data[empty] = np.array([90, 2])
    field_data["plate"] = np.array([99, 3])
    cells = [("tetra", mesh.t.T), ("triangle", np.vstack(list(triangles.values())))]
    tags = [
        np.full(mesh.nelements, 99),
        np.repeat([names.index(n) + 1 for n in triangles], [len(t) for t in triangles.values()]),
    ]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.write(
        path,
        meshio.Mesh(mesh.p.T * scale, cells, cell_data=data, field_data=field_data),
        file_format="gmsh22",
        binary=False,
    )


def findings(folder: Path, *edits: tuple[str, str]) -> list:
    return list(check_meshes(load_machine(edited(folder, *edits))).problems)


def test_slide_is_sound():
    report = check_meshes(load_machine(SLIDE))
    assert report.problems == ()
    assert (report.parts, report.bodies, report.nodes) == (15, 2, 2121)
    iron = 7200 * (0.8 * 0.3 * 0.1 + 0.05 * 0.06 * 0.045 + 0.24 * 0.28 * 0.05)
    steel = 7850 * (
        3 * 0.06**2 * 0.03 + 2 * 0.8 * 0.03**2 + 0.7 * 0.02**2 + 4 * 0.06 * 0.03 * 0.02 + 0.06 * 0.03 * 0.015
    )
    assert report.mass == pytest.approx(iron + steel + 2700 * 0.12**2 * 0.03, rel=1e-9)


def test_mesh_file_in_metres_and_in_declared_millimetres_pass(tmp_path):
    write_plate(tmp_path / "plate.msh", 1000.0)
    assert findings(tmp_path, (PLATE_BOX, 'mesh = "plate.msh"\nmesh_unit = "mm"')) == []
    write_plate(tmp_path / "plate.msh")
    assert findings(tmp_path, (PLATE_BOX, 'mesh = "plate.msh"')) == []


def test_mesh_in_millimetres_read_as_metres(tmp_path):
    write_plate(tmp_path / "plate.msh", 1000.0)
    problems = findings(tmp_path, (PLATE_BOX, 'mesh = "plate.msh"'))
    (size,) = [p for p in problems if "measures" in p.what]
    assert size.where == "parts.plate"
    assert "120 x 120 x 30 m" in size.what
    assert 'mesh_unit = "mm"' in size.remedy
    assert not size.warning


def test_mesh_scaled_down_twice(tmp_path):
    write_plate(tmp_path / "plate.msh")
    problems = findings(tmp_path, (PLATE_BOX, 'mesh = "plate.msh"\nmesh_unit = "mm"'))
    assert any("measures" in p.what and 'mesh_unit = "m" makes it 0.12 x 0.12 x 0.03 m' in p.remedy for p in problems)


@pytest.mark.parametrize(("unit", "length"), [("mm", 1e-3), ("inch", 0.0254)])
def test_the_unit_of_a_mesh_is_found_by_size_and_sensors(tmp_path, unit, length):
    """Read as metres, the plate is 120 m or 4.7 m long: the first is too long, the other's sensor lies beside it."""
    write_plate(tmp_path / "plate.msh", 1.0 / length)
    sensor = '[sensors.plate_top]\npart = "plate"\nposition = [0.05, 0.05, 0.23]\n\n[tcp.tool]'
    problems = findings(tmp_path, (PLATE_BOX, 'mesh = "plate.msh"'), ("[tcp.tool]", sensor))
    found = next(p for p in problems if "measures" in p.what)
    assert f'mesh_unit = "{unit}"' in found.remedy
    assert "or mesh_unit" not in found.remedy  # the sensor leaves one unit only


def test_empty_named_surface(tmp_path):
    write_plate(tmp_path / "plate.msh", empty="table_top")
    (problem,) = findings(tmp_path, (PLATE_BOX, 'mesh = "plate.msh"'))
    assert "surface 'table_top' has no facets" in problem.what


def test_unnamed_outer_facets_with_their_place(tmp_path):
    write_plate(tmp_path / "plate.msh", unnamed="x_max")
    (problem,) = findings(tmp_path, (PLATE_BOX, 'mesh = "plate.msh"'))
    assert "outer facets belong to no named surface" in problem.what
    assert "centroid at (0.06, " in problem.what


def test_surface_that_the_mesh_does_not_have(tmp_path):
    write_plate(tmp_path / "plate.msh")
    problems = findings(
        tmp_path, (PLATE_BOX, 'mesh = "plate.msh"'), ('"slide.z_max", "plate.z_min"', '"slide.z_max", "plate.zmin"')
    )
    (problem,) = [p for p in problems if "unknown surface" in p.what]
    assert problem.where == "contacts.plate.surfaces"
    assert "did you mean 'z_min'?" in problem.remedy


def test_surface_in_no_film_and_in_two_places(tmp_path):
    (problem,) = findings(
        tmp_path,
        ('"plate.*", ', '"plate.x_min", '),
        ("[parts.plate]", '[parts.plate]\nadiabatic = ["y_min", "y_max", "x_max"]'),
    )
    assert "'plate.z_max' belongs to no film" in problem.what
    (problem,) = findings(tmp_path, ("[parts.plate]", '[parts.plate]\nadiabatic = ["z_min"]'))
    assert "'plate.z_min' belongs to the adiabatic list and fixed contacts" in problem.what


def test_fixed_contact_without_overlap(tmp_path):
    (problem,) = findings(tmp_path, ("origin = [-0.06, -0.06, 0.20]", "origin = [-0.06, -0.06, 0.21]"))
    assert "no common area" in problem.what
    assert problem.where == "contacts.plate"


def test_pad_off_the_plane_of_its_rail(tmp_path):
    problems = findings(
        tmp_path,
        (
            "origin = [-0.11, -0.115, 0.13], size = [0.06, 0.03, 0.02]",
            "origin = [-0.11, -0.115, 0.135], size = [0.06, 0.03, 0.015]",
        ),
    )
    (problem,) = problems
    assert "'pad_1.z_min' lies 5 mm off the plane of 'rail_1.z_max'" in problem.what


def test_pad_beside_its_rail(tmp_path):
    (problem,) = findings(tmp_path, ('["rail_1.z_max", "pad_1.z_min"]', '["rail_2.z_max", "pad_1.z_min"]'))
    assert "200 mm beside 'rail_2.z_max'" in problem.what


def test_pad_on_the_wrong_face(tmp_path):
    problems = findings(tmp_path, ('["rail_1.z_max", "pad_1.z_min"]', '["rail_1.y_max", "pad_1.z_min"]'))
    assert any("does not face" in p.what for p in problems)


def test_pad_leaving_the_stations_over_the_stroke(tmp_path):
    problems = findings(tmp_path, ('stroke = ["-200 mm", "200 mm"]', 'stroke = ["-200 mm", "290 mm"]'))
    # rails end at +-0.4 with the last of 8 stations at 0.35; pads 2 and 4 sit at 0.08
    assert [p.what.split("'")[1] for p in problems] == ["pad_2.z_min", "pad_4.z_min"]
    assert all("20 mm beyond" in p.what for p in problems)


def test_sensor_away_from_its_part(tmp_path):
    (problem,) = findings(tmp_path, ("position = [0.07, 0.05, 0.2]", "position = [0.07, 0.05, 0.3]"))
    assert "sensor 'slide' is 100 mm away from part 'slide'" in problem.what
    (problem,) = findings(
        tmp_path, ('part = "slide"\nposition = [0.07, 0.05, 0.2]', 'part = "slide"\nposition = [0.0, 0.0, 0.22]')
    )
    assert "part 'plate' is there" in problem.remedy
    assert findings(tmp_path, ("position = [0.07, 0.05, 0.2]", "position = [0.07, 0.05, 0.204]")) == []


def test_body_joined_to_nothing_and_axis_without_drive(tmp_path):
    problems = findings(tmp_path, ('stiffness = { axial = "150 N/um" }', ""))
    assert [p.where for p in problems] == ["axes.x"]
    assert "drives it" in problems[0].what
    text = SLIDE.read_text()
    contact = text[text.index("[contacts.plate]") : text.index("[contacts.x_guide]")]
    problems = findings(tmp_path, (contact, ""), ('"plate.*", ', '"plate.*", "slide.z_max", '))
    assert any("parts plate are joined to nothing" in p.what for p in problems)


def test_support_missing_a_direction(tmp_path):
    (problem,) = findings(tmp_path, ('["50 N/um", "50 N/um", "200 N/um"]', '["50 N/um", 0, "200 N/um"]'))
    assert "along y" in problem.what


def test_distance_to_part():
    plate = load_part_mesh("plate", load_machine(SLIDE).parts["plate"], SLIDE.parent)  # +-0.06, +-0.06, 0.20 .. 0.23
    for point, expected in [
        ((0.0, 0.0, 0.21), 0.0),
        ((0.06, 0.0, 0.21), 0.0),
        ((0.01, 0.02, 0.25), 0.02),
        ((0.09, 0.0, 0.27), 0.05),  # from the edge
        ((0.07, 0.08, 0.25), 0.03),  # from the corner
    ]:
        assert distance_to_part(plate, np.array(point)) == pytest.approx(expected, abs=1e-12)
