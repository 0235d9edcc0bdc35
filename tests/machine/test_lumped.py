"""Descriptions of lumped machines: every mistake is one problem at its place, with a remedy; oddities are told."""

from __future__ import annotations

import tomllib

import jsonschema
import pytest

from tests.support import descriptions
from tests.support.lumped import SPINDLE, edited, film, write
from twin.build.check_meshes import check_meshes
from twin.errors import DescriptionError
from twin.machine.bodies import bodies_of
from twin.machine.check import check_machine
from twin.machine.check_lumped import total_capacity
from twin.machine.kinematics import moved_bodies
from twin.machine.load import json_schema, load_machine

STEEL_MASS = 'material = "steel"\nmass = "12 kg"'


def test_the_spindle_is_read_in_si_and_has_nothing_odd():
    machine = load_machine(SPINDLE)
    assert machine.lumped
    assert machine.nodes["bed"].capacity == pytest.approx(180e3)
    assert machine.nodes["stator"].volume == pytest.approx(1.5e-3)
    assert machine.bars["screw"].cross_section == pytest.approx(8e-4)
    assert machine.tcp.expansion["shaft"] == pytest.approx((3.2e-6, 0.0, 0.0))
    assert [b.name for b in bodies_of(machine)] == ["bearing_front", "bed"]
    assert moved_bodies(machine, "x") == {"bearing_front"}
    assert check_machine(machine) == []
    report = check_meshes(machine)
    assert report.problems == ()
    assert report.nodes == 9 + 13
    steel = (12 + 5 + 25 + 40 + 1.2 + 7850 * (1.5e-3 + 8e-4 * 0.6)) * 470.0
    assert report.capacity == pytest.approx(900.0 + 700.0 + 180e3 + steel)
    assert total_capacity(machine) == report.capacity


def test_schema_accepts_the_spindle():
    described, schema = tomllib.loads((SPINDLE / "machine.toml").read_text()), json_schema()
    jsonschema.validate(described, schema)
    described["nodes"]["bearing_front"]["capacty"] = 1.0
    assert not jsonschema.Draft202012Validator(schema).is_valid(described)


@pytest.mark.parametrize(
    ("old", "new", "place", "says", "remedy"),
    [
        ('capacity = "900 J/K"', 'capacity = "900 J/kg"', "nodes.bearing_front.capacity",
         "not a quantity in J/K", "J/K"),
        ('capacity = "900 J/K"', "capacity = -1", "nodes.bearing_front.capacity", "greater than 0", "1200 J/K"),
        ('capacity = "900 J/K"', 'area = "1 m^2"', "nodes.bearing_front.capacity", "give a capacity", "mass"),
        (STEEL_MASS, STEEL_MASS + '\nvolume = "1 l"', "nodes.shaft.capacity", "give a capacity", "volume"),
        (STEEL_MASS, STEEL_MASS + "\ncapacity = 1", "nodes.shaft.capacity", "give a capacity", "capacity"),
        (STEEL_MASS, STEEL_MASS.replace("steel", "stel"), "nodes.shaft.material", "unknown material", "'steel'"),
        ('capacity = "900 J/K"', 'capacty = "900 J/K"', "nodes.bearing_front.capacty", "unknown key", "'capacity'"),
        ("elements = 12", "elements = 1", "bars.screw.elements", "greater than or equal to 2", "20"),
        ("elements = 12", "elments = 12", "bars.screw.elments", "unknown key", "'elements'"),
        ('perimeter = "100 mm"\n', "", "bars.screw", "has a film but no perimeter", "100 mm"),
        ("direction = [1.0, 0.0, 0.0]\nlength", "direction = [0, 0, 0]\nlength", "bars.screw.direction",
         "no length", ""),
        ('length = "600 mm"', 'length = "600 s"', "bars.screw.length", "not a quantity in m", "800 mm"),
        ('["bearing_front", "housing"]', '["bearing_front", "hosing"]', "contacts.front_outer.surfaces",
         "no node or bar 'hosing'", "'housing'"),
        ('["screw.start", "bed"]', '["screw.strat", "bed"]', "contacts.screw_bearing.surfaces",
         "unknown surface", "start"),
        ('["screw.start", "bed"]', '["screw", "bed"]', "contacts.screw_bearing.surfaces", "a whole bar", "screw.start"),
        ('["bearing_front", "shaft"]', '["shaft.top", "shaft"]', "contacts.front_inner.surfaces",
         "no surfaces", "shaft"),
        ('total = "14 W/K"', "", "contacts.front_outer", "without conductance", "12 W/K"),
        ('total = "14 W/K"', 'total = "14 W/(m^2*K)"', "contacts.front_outer.total", "not a quantity in W/K", "12 W/K"),
        ('total = "14 W/K"', 'conductance = "14 W/(m^2*K)"', "contacts.front_outer", "without an area", "total"),
        ('total = "14 W/K"', 'total = "14 W/K"\narea = 1', "contacts.front_outer.area", "beside 'total'", "the one"),
        ('total = "14 W/K"', 'total = "14 W/K"\nstiffness = { axial = 1 }', "contacts.front_outer.stiffness",
         "of a lumped machine", "bend"),
        ('pairs = [["screw", "nut"]]', 'pairs = [["screw", "nut"]]\nsegments = 4', "contacts.x_screw.segments",
         "of a lumped machine", "elements"),
        ('pairs = [["screw", "nut"]]', 'pairs = [["scrw", "nut"]]', "contacts.x_screw.pairs",
         "no node or bar", "'screw'"),
        ('pairs = [["screw", "nut"]]', 'pairs = [["screw", "nutt"]]', "contacts.x_screw.pairs",
         "no node 'nutt'", "'nut'"),
        ('pairs = [["screw", "nut"]]', 'pairs = [["bed", "nut"]]', "contacts.x_screw.pairs",
         "'bed' is a node", "screw"),
        ("position = [0.15, 0.0, 0.3]\n", "", "nodes.nut", "has no position", "position"),
        ("direction = [1.0, 0.0, 0.0]\nstroke", "direction = [0, 1, 0]\nstroke", "contacts.x_screw.pairs",
         "not parallel", "direction"),
        ('carries = ["slide"]', 'carries = ["slid"]', "axes.x.carries", "unknown part 'slid'", "'slide'"),
        ('carries = ["slide"]', 'carries = ["bed", "slide"]', "axes.x.carries", "both move", "one side"),
        ('position = "x_position"', 'position = "x_position"\nencoder = { kind = "linear" }', "axes.x.encoder",
         "linear encoder", "expansion"),
        ('surface = "bearing_rear"', 'surface = "bearing_raer"', "sources.rear.surface", "no node or bar",
         "'bearing_rear'"),
        ('contact = "x_screw"', 'contact = "x_scrw"', "sources.nut.contact", "unknown moving contact", "'x_screw'"),
        ('surfaces = ["jacket"]', 'surfaces = ["jackt"]', "films.coolant.surfaces", "no node or bar", "'jacket'"),
        ('surfaces = ["jacket"]', 'surfaces = ["jacket", "housing"]', "films.air.surfaces",
         "with its whole area", "area"),
        ('surfaces = ["jacket"]', 'surfaces = ["stator"]', "nodes.stator", "has a film but no area", "0.1 m^2"),
        ('surfaces = ["slide", "nut", "screw"]', 'surfaces = ["slide", "nut", "screw.end"]', "films.moving.surfaces",
         "unknown surface", "'screw'"),
        ('surfaces = ["housing", "shaft", "bed"]', 'surfaces = ["housing", "shaft"]\narea = 1', "films.air.area",
         "'area' of a film of 2", "each"),
        ('signal = "coolant_inlet"', 'signal = "coolant_inlet"\ngradient = "1 K/m"', "nodes.jacket", "no height", ""),
        ('part = "housing"', 'part = "housng"', "sensors.housing.part", "no node or bar", "'housing'"),
        ('part = "housing"', 'part = "housing"\nposition = [0, 0, 0]', "sensors.housing.position",
         "one temperature", ""),
        ("position = [0.25, 0.0, 0.3]\n", "", "sensors.screw_middle", "without a position", "screw.start"),
        ("shaft = [", "shat = [", "tcp.expansion.shat", "no node or bar", "'shaft'"),
        ('"3.2 um/K"', '"3.2 um"', "tcp.expansion.shaft.0", "not a quantity in m/K", ""),
        ('screw = "tool"', 'screw = "tol"', "tcp.screws.screw", "'tool'", "'tool'"),
        ('screw = "tool"', 'bed = "tool"', "tcp.screws.bed", "is a node", "screw"),
        ("[tcp.expansion]", '[tcp.tool]\nsurface = "a.b"\n[tcp.expansion]', "tcp.tool", "of a lumped machine",
         "expansion"),
        ("[poses]", '[supports.a]\nsurface = "bed.z"\nstiffness = [1, 1, 1]\n[poses]', "supports.a",
         "a support", "remove"),
        ("[nodes.bed]", "[nodes.screw]\ncapacity = 1\n[nodes.bed]", "nodes.screw", "also a bar", "name"),
        ('total = "4 W/K"', 'joint = { law = "no_law" }\narea = 1', "contacts.screw_bearing.joint.law",
         "no joint law", ""),
    ],
)  # fmt: skip
def test_each_mistake_is_one_problem_at_its_place(tmp_path, old, new, place, says, remedy):
    with pytest.raises(DescriptionError) as caught:
        load_machine(edited(tmp_path, (old, new)))
    (problem,) = caught.value.problems
    assert f"machine.toml: {place}" in problem.where
    assert "(line " in problem.where
    assert says in problem.what
    assert remedy in problem.remedy
    assert problem.remedy


def test_a_node_beside_parts_needs_a_film(tmp_path):
    path = descriptions.edited(tmp_path, ("[axes.x]", '[nodes.a]\ncapacity = 1\narea = "1 m^2"\n\n[axes.x]'))
    with pytest.raises(DescriptionError) as caught:
        load_machine(path)
    (problem,) = caught.value.problems
    assert "is in no films" in problem.what


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("segments = 8", "segments = 8\narea = 1", "contacts.x_guide.area"),
        ("segments = 8", 'segments = 8\ntotal = "1 W/K"', "contacts.x_guide.total"),
        ('environment = "floor"\n', 'environment = "floor"\narea = 1\n', "films.floor.area"),
        ("[tcp.work]", '[tcp.screws]\nscrew = "tool"\n\n[tcp.work]', "tcp.screws"),
    ],
)
def test_what_only_lumped_machines_have_is_refused_beside_meshes(tmp_path, old, new, place):
    with pytest.raises(DescriptionError) as caught:
        load_machine(descriptions.edited(tmp_path, (old, new)))
    (problem,) = caught.value.problems
    assert f"machine.toml: {place} (line" in problem.where
    assert "in a machine with meshes" in problem.what


def test_what_no_film_reaches_is_named(tmp_path):
    text = '[nodes.a]\ncapacity = "1 kJ/K"\narea = 1\n[nodes.b]\ncapacity = "1 kJ/K"\n'
    path = write(tmp_path, text, film("air", "a", 5.0))
    with pytest.raises(DescriptionError, match="no film cools b"):
        load_machine(path)
    write(tmp_path, text, film("air", "a", 5.0), '[contacts.ab]\nkind = "fixed"\nsurfaces = ["a", "b"]\ntotal = 3\n')
    load_machine(path)


def test_a_screw_needs_one_nut(tmp_path):
    for new, says in (("", "no nuts run on"), ('[["screw", "nut"], ["screw", "housing"]]', "2 nuts run on")):
        text = (SPINDLE / "machine.toml").read_text()
        if new:
            text = text.replace('[["screw", "nut"]]', new)
        else:
            text = text.replace('kind = "moving"\naxis = "x"\npairs = [["screw", "nut"]]',
                                'kind = "fixed"\nsurfaces = ["screw.end", "nut"]').replace(
                'contact = "x_screw"\nrail_share = 0.5', 'surface = "nut"')  # fmt: skip
        (tmp_path / "machine.toml").write_text(text)
        with pytest.raises(DescriptionError, match=says):
            load_machine(tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "place", "says", "warning"),
    [
        ('capacity = "180 kJ/K"', "capacity = 3e8", "nodes.bed", "3e+08 J/K is that of 6.38e+05 kg", True),
        ('area = "0.5 m^2"', "area = 500", "nodes.slide.area", "a wall of", True),
        ('area = "0.5 m^2"', 'area = "5 mm^2"', "nodes.slide.area", "a wall of", True),
        ('perimeter = "100 mm"', 'perimeter = "10 mm"', "bars.screw.perimeter", "cannot hold", False),
        ('length = "600 mm"', "length = 600", "bars.screw", "a bar of 600 m", False),
        ('total = "14 W/K"', 'total = "14 kW/K"', "contacts.front_outer", "make its two sides one", True),
        ('"3.2 um/K"', "3.2", "tcp.expansion.shaft", "ten metres", False),
    ],
)
def test_odd_descriptions_are_reported_with_their_place(tmp_path, old, new, place, says, warning):
    (problem,) = check_machine(load_machine(edited(tmp_path, (old, new))))
    assert problem.where == f"machine.toml: {place}"
    assert says in problem.what
    assert problem.warning == warning


def test_a_nut_that_leaves_its_screw_is_found(tmp_path):
    report = check_meshes(load_machine(edited(tmp_path, ('"350 mm"]', '"420 mm"]'), ("350.0", "420.0"))))
    (problem,) = report.problems
    assert "'nut' runs" in problem.what
    assert "elements" in problem.remedy
