"""A part that is described once and used several times."""

from __future__ import annotations

import json
import tomllib

import numpy as np
import pytest

from twin.cli.main import run
from twin.errors import DescriptionError
from twin.machine.description import Instance
from twin.machine.instances import expanded, rotation, written_out
from twin.machine.load import json_schema, load_machine

REST = """
[machine]
name = "pair"
[materials.steel]
conductivity = "45 W/(m*K)"
density = "7850 kg/m^3"
heat_capacity = "470 J/(kg*K)"
expansion = "11.7e-6 1/K"
[environment.room]
temperature = "21 degC"
[nodes.bed]
capacity = "20 kJ/K"
area = "0.8 m^2"
[films.bed]
law = "constant_film"
surfaces = ["bed"]
environment = "room"
parameters = { natural = 5.0 }
"""
TEMPLATE = """
[templates.drive.nodes.nut]
capacity = "300 J/K"
area = "0.01 m^2"
position = ["300 mm", 0.0, 0.0]
[templates.drive.bars.screw]
material = "steel"
origin = [0.0, 0.0, "20 mm"]
direction = [1.0, 0.0, 0.0]
length = "600 mm"
cross_section = "5 cm^2"
perimeter = "80 mm"
[templates.drive.axes.feed]
direction = [1.0, 0.0, 0.0]
stroke = ["-200 mm", "200 mm"]
carries = ["nut"]
position = "position"
[templates.drive.signals.position]
unit = "mm"
range = [-200.0, 200.0]
[templates.drive.signals.speed]
column = "v"
unit = "m/min"
range = [-30.0, 30.0]
[templates.drive.contacts.nut]
kind = "moving"
axis = "feed"
pairs = [["screw", "nut"]]
total = "4 W/K"
[templates.drive.contacts.bearing]
kind = "fixed"
surfaces = ["screw.start", "bed"]
total = "2 W/K"
[templates.drive.sources.nut]
law = "guide_friction"
contact = "nut"
parameters = { load = "2 kN" }
signals = { speed = "speed" }
[templates.drive.films.screw]
law = "constant_film"
surfaces = ["screw", "nut"]
environment = "room"
parameters = { natural = 8.0 }
[templates.drive.sensors.screw]
part = "screw"
position = ["100 mm", 0.0, 0.0]
"""
INSTANCES = """
[instances.left]
of = "drive"
[instances.up]
of = "drive"
origin = [0.0, "500 mm", 0.0]
x = [0.0, 0.0, 2.0]
z = [1.0, 0.0, 0.0]
"""
BY_HAND = """
[nodes.NAME_nut]
capacity = "300 J/K"
area = "0.01 m^2"
position = POSITION
[bars.NAME_screw]
material = "steel"
origin = ORIGIN
direction = ALONG
length = "600 mm"
cross_section = "5 cm^2"
perimeter = "80 mm"
[axes.NAME_feed]
direction = ALONG
stroke = ["-200 mm", "200 mm"]
carries = ["NAME_nut"]
position = "NAME_position"
[signals.NAME_position]
unit = "mm"
range = [-200.0, 200.0]
[signals.NAME_speed]
column = "NAME_v"
unit = "m/min"
range = [-30.0, 30.0]
[contacts.NAME_nut]
kind = "moving"
axis = "NAME_feed"
pairs = [["NAME_screw", "NAME_nut"]]
total = "4 W/K"
[contacts.NAME_bearing]
kind = "fixed"
surfaces = ["NAME_screw.start", "bed"]
total = "2 W/K"
[sources.NAME_nut]
law = "guide_friction"
contact = "NAME_nut"
parameters = { load = "2 kN" }
signals = { speed = "NAME_speed" }
[films.NAME_screw]
law = "constant_film"
surfaces = ["NAME_screw", "NAME_nut"]
environment = "room"
parameters = { natural = 8.0 }
[sensors.NAME_screw]
part = "NAME_screw"
position = SENSED
"""


def by_hand(name: str, along: str, position: str, origin: str, sensed: str) -> str:
    pairs = {"NAME": name, "ALONG": along, "POSITION": position, "ORIGIN": origin, "SENSED": sensed}
    text = BY_HAND
    for key, value in pairs.items():
        text = text.replace(key, value)
    return text


def read(tmp_path, text: str):
    path = tmp_path / "machine.toml"
    path.write_text(text)
    return load_machine(path)


def test_instances_are_what_one_would_write_by_hand(tmp_path):
    written = by_hand("left", "[1.0, 0.0, 0.0]", "[0.3, 0.0, 0.0]", "[0.0, 0.0, 0.02]", "[0.1, 0.0, 0.0]")
    written += by_hand("up", "[0.0, 0.0, 1.0]", "[0.0, 0.5, 0.3]", "[0.02, 0.5, 0.0]", "[0.0, 0.5, 0.1]")
    assert read(tmp_path, REST + TEMPLATE + INSTANCES) == read(tmp_path, REST + written)


def test_the_text_written_out_is_the_same_machine(tmp_path):
    """What an artefact keeps knows no templates; arrays of tables survive."""
    text = REST + TEMPLATE + INSTANCES + '[[parameters]]\npath = "films.*.gain"\ntolerance = "20 %"\n'
    out = written_out(text)
    assert "templates" not in tomllib.loads(out)
    assert read(tmp_path, out) == read(tmp_path, text)
    assert written_out(REST) == REST


def test_frames_are_rotations():
    rng = np.random.default_rng(0)
    for _ in range(20):
        R = rotation(Instance(of="a", x=tuple(rng.standard_normal(3))))
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(R) == pytest.approx(1.0)
    np.testing.assert_allclose(rotation(Instance(of="a")), np.eye(3))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('of = "drive"', 'of = "drvie"', "did you mean 'drive'"),
        ("[instances.up]", "[instances.up]\nplace = 3", "'place'"),
        ("x = [0.0, 0.0, 2.0]", "x = [0.0, 0.0, 0.0]", "span no frame"),
        ("x = [0.0, 0.0, 2.0]", "x = [-3.0, 0.0, 0.0]", "span no frame"),
        ("x = [0.0, 0.0, 2.0]", 'x = "up"', "'x'"),
        ("[templates.drive.nodes.nut]", "[templates.drive.parts.nut]", "parts in a template"),
        ("[templates.drive.nodes.nut]", "[templates.drive.knots.nut]", "no 'knots' in a template"),
        ("[instances.left]", "[nodes.left_nut]\ncapacity = 3.0\n[instances.left]", "there is already"),
        ("[instances.left]", "[templates.other.nodes.a]\ncapacity = 3.0\n[instances.left]", "no instance"),
    ],
)
def test_mistakes_of_instances(tmp_path, old, new, said):
    text = (REST + TEMPLATE + INSTANCES).replace(old, new, 1)
    with pytest.raises(DescriptionError) as caught:
        read(tmp_path, text)
    assert said in str(caught.value)
    assert "machine.toml" in str(caught.value)


def test_a_mistake_in_a_template_is_said_once_where_it_is_written(tmp_path, capsys):
    text = (REST + TEMPLATE + INSTANCES).replace('material = "steel"', 'material = "stel"')
    (tmp_path / "machine.toml").write_text(text)
    assert run(["check", "--json", str(tmp_path)]) == 2
    (problem,) = json.loads(capsys.readouterr().out)["problems"]
    line = text.splitlines().index('material = "stel"') + 1
    assert f"templates.drive.bars.screw.material (line {line})" in problem["where"]


@pytest.mark.parametrize(
    "text",
    ["templates = 3\n", "instances = []\n", "templates.a = 1\ninstances.b.of = 'a'\n", "templates.a.nodes = 1\n"],
)
def test_tables_of_the_wrong_kind(tmp_path, text):
    with pytest.raises(DescriptionError) as caught:
        read(tmp_path, text + REST)
    assert "no table of tables" in str(caught.value)


def test_a_section_of_the_wrong_kind_beside_instances(tmp_path):
    text = "sensors = 3\n" + (REST + TEMPLATE + INSTANCES).replace(
        "[templates.drive.sensors.screw]", "[templates.drive.sensors.s]"
    )
    with pytest.raises(DescriptionError) as caught:
        read(tmp_path, text)
    assert "sensors" in str(caught.value)


def test_names_of_other_sections_stay(tmp_path):
    """A material that is called like an entry of the template is the machine's."""
    data = tomllib.loads((REST + TEMPLATE + INSTANCES).replace("steel", "screw"))
    made, origins = expanded(data)
    assert made["bars"]["up_screw"]["material"] == "screw"
    assert origins["bars", "up_screw"] == ("templates", "drive", "bars", "screw")


def test_editors_learn_of_both():
    properties = json_schema()["properties"]
    assert set(properties) >= {"templates", "instances", "struts"}
