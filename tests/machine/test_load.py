"""Reading machine.toml: all mistakes at once, each with its line and the name that was meant."""

from __future__ import annotations

import json
import shutil
import tomllib
from pathlib import Path

import jsonschema
import pytest

from tests.support.descriptions import SLIDE, edited
from twin.errors import DescriptionError
from twin.machine.load import json_schema, load_machine, write_schema
from twin.machine.toml_lines import key_lines, line_of


def problems_of(path: Path) -> list:
    with pytest.raises(DescriptionError) as caught:
        load_machine(path)
    return list(caught.value.problems)


def test_slide_is_read_in_si_with_its_folder():
    machine = load_machine(SLIDE)
    assert machine.folder == SLIDE.parent
    assert machine.materials["cast_iron"].youngs_modulus == pytest.approx(120e9)
    assert machine.parts["bed"].box.size == pytest.approx((0.8, 0.3, 0.1))
    assert machine.axes["x"].stroke == pytest.approx((-0.2, 0.2))
    assert load_machine(SLIDE.parent) == machine


def test_three_typos_are_all_reported_with_the_names_that_were_meant(tmp_path):
    path = edited(
        tmp_path,
        ('material = "aluminium"', 'material = "aluminum"'),
        ('stroke = ["-200 mm"', 'strok = ["-200 mm"'),
        ('law = "motor_copper"', 'law = "motor_coper"'),
    )
    problems = problems_of(path)
    assert len(problems) == 3  # nothing that merely follows from them
    lines = path.read_text().splitlines()
    for meant, typo, problem in zip(
        ("aluminium", "stroke", "motor_copper"), ("aluminum", "strok", "motor_coper"), problems, strict=True
    ):
        assert f"did you mean '{meant}'?" in problem.remedy
        assert typo in problem.what
        number = int(problem.where.rpartition("line ")[2].rstrip(")"))
        assert typo in lines[number - 1]


def test_syntax_error_names_the_line(tmp_path):
    (problem,) = problems_of(edited(tmp_path, ("[axes.x]", "[axes.x")))
    number = next(
        i for i, line in enumerate((tmp_path / "machine.toml").read_text().splitlines(), 1) if line == "[axes.x"
    )
    assert f"line {number}" in problem.what
    assert "[axes.x" in problem.remedy


@pytest.mark.parametrize(
    ("old", "new", "place", "says"),
    [
        ('"50 W/(m*K)"', '"50 W/m"', "materials.cast_iron.conductivity", "not a quantity in W/(m*K)"),
        ('"50 W/(m*K)"', "-50", "materials.cast_iron.conductivity", "greater than 0"),
        ('"50 W/(m*K)"', "nan", "materials.cast_iron.conductivity", "finite"),
        ("poisson_ratio = 0.26\n", "", "materials.cast_iron.poisson_ratio", "missing key"),
        ("poisson_ratio = 0.26", "poisson_ratio = 0.5", "materials.cast_iron.poisson_ratio", "less than 0.5"),
        ('carries = ["slide"]', 'carries = ["slyde"]', "axes.x.carries", "unknown part 'slyde'"),
        ('carries = ["slide"]', 'carries = ["bed"]', "axes.x.carries", "moves the body that stands on"),
        ('position = "x_position"', 'position = "x_current"', "axes.x.position", "expected a unit of m"),
        ("direction = [1.0, 0.0, 0.0]", "direction = [0, 0, 0]", "axes.x.direction", "no length"),
        ('"screw.x_min"', '"screw.xmin"', "contacts.screw_end.surfaces", "unknown surface"),
        ('"screw.x_min"', '"screw"', "contacts.screw_end.surfaces", "is not a surface"),
        ('["screw.z_max", "nut.z_min"]', '["screw.z_max", "nutt.z_min"]', "contacts.x_screw.pairs", "unknown part"),
        ("segments = 8", "segments = 1", "contacts.x_guide.segments", "greater than or equal to 2"),
        ('axial = "150 N/um"', 'axial = "150 N"', "contacts.x_screw.stiffness.axial", "not a quantity in N/m"),
        ('unit = "m/min"', 'unit = "m/minute2"', "signals.x_speed.unit", "unknown unit"),
        ("range = [0.0, 12.0]", "range = [12.0, 0.0]", "signals.x_current.range", "is empty"),
        ('signal = "shop_air"', 'signal = "shopair"', "environment.shop.signal", "unknown signal"),
        ('temperature = "19 degC"', 'temperature = "19 K/m"', "environment.floor.temperature", "not a quantity"),
        ('contact = "x_screw"', 'contact = "x_scrw"', "sources.x_nut.contact", "unknown moving contact"),
        ('force = "500 N", ', "", "sources.x_nut.parameters", "needs 'force'"),
        ('resistance = "0.5 ohm"', 'resistance = "0.5 W"', "sources.x_motor.parameters.resistance", "not a quantity"),
        ('current = "x_current"', 'current = "x_speed"', "sources.x_motor.signals.current", "expected a unit of A"),
        ('environment = "floor"', 'environment = "flor"', "films.floor.environment", "unknown environment"),
        ('"foot_3.*"]', '"foot_3.*", "bed.*"]', "films.floor.surfaces", "also in films.structure"),
        ('part = "bed"', 'part = "bde"', "sensors.bed_front.part", "unknown part"),
        ("point = [0.0, 0.0, 0.28]", "", "tcp.tool", "no tool centre point"),
        ("x = 5", "xx = 5", "poses.xx", "unknown linear axis"),
        ("x = 5", "x = [0.1, -0.1]", "poses.x", "do not increase"),
        ("x = 5", "x = [0.1, 0.3]", "poses.x", "leave the stroke"),
        ("x = 5", 'x = "five"', "poses.x", "valid integer"),
        ("rail_share = 0.5", "rail_share = 1.5", "sources.x_nut.rail_share", "less than or equal to 1"),
    ],
)  # fmt: skip
def test_each_mistake_is_one_problem_at_its_place(tmp_path, old, new, place, says):
    (problem,) = problems_of(edited(tmp_path, (old, new)))
    assert f"machine.toml: {place} (line" in problem.where
    assert says in problem.what
    assert problem.remedy


_SWITCHED = (
    "[environment.shop]",
    '[signals.cabinet]\nunit = "1"\nrange = [0, 1]\n\n[sources.cabinet]\nsurface = "bed.x_min"\n'
    'law = "switched_heat"\nparameters = { power = "80 W" }\nsignals = { switch = "cabinet" }\n\n[environment.shop]',
)


@pytest.mark.parametrize("wide", ["[0, 100]", "[-1, 1]"])
def test_signals_stay_within_what_an_argument_can_be(tmp_path, wide):
    """A switch in percent would make a hundred times the heat."""
    assert load_machine(edited(tmp_path, _SWITCHED)).sources["cabinet"].law == "switched_heat"
    percent = (_SWITCHED[0], _SWITCHED[1].replace("[0, 1]", wide))
    (problem,) = problems_of(edited(tmp_path, percent))
    assert "sources.cabinet.signals.switch (line" in problem.where
    assert "outside 0 .. 1" in problem.what
    assert "signals.cabinet.range" in problem.remedy


def test_temperatures_that_are_wired_stay_above_absolute_zero(tmp_path):
    """A range in the wrong unit: kelvin below zero."""
    warm = ('law = "motor_copper"', 'law = "motor_winding"')
    wired = ('{ current = "x_current" }', '{ current = "x_current", temperature = "winding" }')
    for low, found in (("-273.15", 0), ("-300", 1)):
        sensor = f'[signals.winding]\nunit = "degC"\nrange = [{low}, 150]\n\n[environment.shop]'
        path = edited(tmp_path, warm, wired, ("[environment.shop]", sensor))
        problems = problems_of(path) if found else load_machine(path) and []
        assert len(problems) == found
        assert all("sources.x_motor.signals.temperature" in p.where for p in problems)
        assert all("outside -273.15" in p.what for p in problems)


def test_missing_mesh_file_names_the_one_beside_it(tmp_path):
    (tmp_path / "plate.msh").write_text("")
    path = edited(
        tmp_path,
        (
            "box = { origin = [-0.06, -0.06, 0.20], size = [0.12, 0.12, 0.03], divisions = [3, 3, 1] }",
            'mesh = "plates.msh"',
        ),
    )
    (problem,) = problems_of(path)
    assert "no mesh file 'plates.msh'" in problem.what
    assert "plate.msh" in problem.remedy


def test_empty_file_lists_what_is_needed_once_each(tmp_path):
    (tmp_path / "machine.toml").write_text("")
    problems = problems_of(tmp_path)
    assert [p.what for p in problems] == [
        f"missing key '{k}'" for k in ("machine", "materials", "parts", "environment", "films")
    ]


@pytest.mark.parametrize(
    "text",
    [
        "parts = 3",
        "[parts]\nbed = 3",
        "[[parts]]",
        "folder = '/'",
        "tcp = [1]",
        "poses.x = {}",
        "parameters = 3",
        "parameters = [1]",
        "parameters = [[]]",
        "[parameters.a]",
    ],
)
def test_odd_shapes_are_described_not_crashed_on(tmp_path, text):
    (tmp_path / "machine.toml").write_text(text)
    assert problems_of(tmp_path)


def test_no_file_and_not_utf8(tmp_path):
    (problem,) = problems_of(tmp_path)
    assert problem.what == "no such file"
    (tmp_path / "machine.toml").write_bytes(b'[machine]\nname = "M\xfcller"\n')
    (problem,) = problems_of(tmp_path)
    assert "UTF-8" in problem.what


def test_schema_accepts_the_slide_and_refuses_a_typo(tmp_path):
    write_schema(tmp_path / "schema.json")
    schema = json.loads((tmp_path / "schema.json").read_text())
    assert schema == json_schema()
    data = tomllib.loads(SLIDE.read_text())
    jsonschema.validate(data, schema)
    data["parameters"] = [{"path": "films.*.gain", "tolerance": "20 %", "low": 0.5}, {"path": "*", "fixed": True}]
    jsonschema.validate(data, schema)
    data["parts"]["bed"]["materiel"] = "steel"
    with pytest.raises(jsonschema.ValidationError, match="materiel"):
        jsonschema.validate(data, schema)


def test_key_lines_skip_strings_and_arrays():
    text = "\n".join(
        [
            "a = 1",
            "[t.'u v']",
            "b = [ # ] not the end",
            '  "x = 3]",',
            "]",
            'c = """',
            "d = 4",
            '"""',
            "e.f = { g = 5 }",
        ]
    )
    lines = key_lines(text)
    assert lines == {("a",): 1, ("t", "u v"): 2, ("t", "u v", "b"): 3, ("t", "u v", "c"): 6, ("t", "u v", "e", "f"): 9}
    assert line_of(lines, ("t", "u v", "e", "f", "g")) == 9
    assert line_of(lines, ("z",)) is None


def test_key_lines_number_arrays_of_tables():
    text = "x = 1\n[[a.b]] # one\nc = 1\n[a.b.d]\ne = [[2]]\n[[a.b]]\nc.f = 3\n[a.g]\n"
    assert key_lines(text) == {
        ("x",): 1, ("a", "b"): 2, ("a", "b", "0"): 2, ("a", "b", "0", "c"): 3, ("a", "b", "0", "d"): 4,
        ("a", "b", "0", "d", "e"): 5, ("a", "b", "1"): 6, ("a", "b", "1", "c", "f"): 7, ("a", "g"): 8,
    }  # fmt: skip


def test_copy_of_folder_reads_alike(tmp_path):
    shutil.copytree(SLIDE.parent, tmp_path / "copy")
    assert load_machine(tmp_path / "copy").parts == load_machine(SLIDE).parts


@pytest.mark.parametrize(("written", "positions"), [("5.0", 5), ('["-200 mm", 0, "0.1 m"]', (-0.2, 0.0, 0.1))])
def test_poses_as_whole_floats_and_with_units(tmp_path, written, positions):
    machine = load_machine(edited(tmp_path, ("x = 5", f"x = {written}")))
    assert machine.poses == {"x": positions}
