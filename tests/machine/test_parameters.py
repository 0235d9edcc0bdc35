"""What measurements may correct: defaults, `[[parameters]]` tables, and every mistake in them at its place."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from tests.support import descriptions, lumped
from tests.support.descriptions import MACHINES, SLIDE
from twin.errors import DescriptionError
from twin.machine.load import load_machine
from twin.machine.parameters import parameter_units, parameters
from twin.machine.wiring import joint_conductance
from twin.rom.parameter import Parameter


def by_path(machine) -> dict[str, Parameter]:
    return {p.path: p for p in parameters(machine)}


def with_tables(folder: Path, tables: str, *edits: tuple[str, str]):
    """The spindle with `[[parameters]]` tables at its end."""
    path = lumped.edited(folder, *edits)
    path.write_text(path.read_text(encoding="utf-8") + tables, encoding="utf-8")
    return path


def declared(path: str, more: str = "") -> str:
    return f'\n[[parameters]]\npath = "{path}"\n{more}\n'


def test_every_kind_of_the_slide_acts_on_what_its_path_names():
    machine = load_machine(SLIDE)
    found = by_path(machine)
    assert set(found["materials.steel.heat_capacity"].targets) == {
        name for name, part in machine.parts.items() if part.material == "steel"
    }
    assert found["materials.aluminium.expansion"].targets == ("plate",)
    kinds = {path: (p.kind, p.targets) for path, p in found.items()}
    assert kinds["contacts.x_guide.conductance"] == ("contact", ("x_guide",))
    assert kinds["contacts.screw_end.conductance"] == ("joint", ("screw_end",))
    assert kinds["sources.x_nut.gain"] == ("source", ("x_nut",))
    assert kinds["films.floor.gain"] == ("film", ("floor",))
    assert kinds["environment.shop.offset"] == ("environment", ("shop",))
    assert "environment.floor.offset" not in found  # constant: only where a table names it
    assert len(found) == 3 * 2 + 15 + 1 + 3 + 3


def test_defaults_are_those_of_the_reference_page():
    found = by_path(load_machine(lumped.SPINDLE))

    def row(path: str) -> tuple[float, float, float]:
        p = found[path]
        return p.sigma, p.low / p.nominal, p.high / p.nominal

    assert row("sources.motor.gain") == pytest.approx((math.log(1.25), 0.2, 5.0))
    assert row("films.air.gain") == pytest.approx((math.log(1.3), 0.2, 5.0))
    assert row("contacts.front_outer.total") == pytest.approx((math.log(1.4), 0.2, 5.0))
    assert row("nodes.bed.capacity") == pytest.approx((math.log(1.2), 0.2, 5.0))
    assert row("materials.steel.heat_capacity") == pytest.approx((math.log(1.05), 1 / 1.5, 1.5))
    assert row("materials.steel.expansion") == pytest.approx((math.log(1.03), 1 / 1.2, 1.2))
    offset = found["environment.coolant.offset"]
    assert (offset.scale, offset.sigma, offset.low, offset.high) == ("linear", 0.5, -3.0, 3.0)
    growth = found["tcp.expansion.housing.x"]  # -0.8 um/K beside 1.1 um/K
    assert (growth.scale, growth.component, growth.targets) == ("linear", 0, ("housing",))
    assert growth.sigma == pytest.approx(0.33e-6)
    assert growth.low < growth.nominal < growth.high


@pytest.mark.parametrize("path", MACHINES, ids=lambda p: p.parent.name)
def test_nominal_values_are_those_of_the_description_and_lie_inside_their_bounds(path):
    machine = load_machine(path)
    found = parameters(machine)
    assert len(found) > (20 if machine.has_tcp else 2)  # a plate: its heater, its film, its heat capacity
    assert len({p.path for p in found}) == len(found)
    for p in found:
        value = machine
        for key in p.path.split("."):
            if isinstance(value, tuple):
                value = value["xyz".index(key)]
            else:
                value = value[key] if isinstance(value, dict) else getattr(value, key)
        assert p.nominal == value
        assert p.low < p.nominal < p.high
        assert p.coordinate(p.nominal) == 0.0
        assert p.value(p.coordinate(p.high)) == pytest.approx(p.high)
        assert parameter_units(machine)[p.path] == p.unit
        assert Parameter.from_json(p.to_json()) == p


def test_lumped_expansion_of_a_material_is_that_of_screws(tmp_path):
    assert by_path(load_machine(lumped.SPINDLE))["materials.steel.expansion"].targets == ("screw",)
    mixed = lumped.edited(tmp_path, ("shaft = [", 'screw = ["1 um/K", 0.0, 0.0]\nshaft = ['))
    found = by_path(load_machine(mixed))
    assert "materials.steel.expansion" not in found
    assert found["tcp.expansion.screw.x"].targets == ("screw",)
    still = lumped.edited(tmp_path, ('[tcp.screws]\nscrew = "tool"', ""))
    assert "materials.steel.expansion" not in by_path(load_machine(still))


def test_gain_of_a_joint_law_multiplies_it(tmp_path):
    law = (
        'joint = {{ law = "bolted_joint"{gain}, parameters = {{ pressure = "2 MPa", hardness = "2 GPa", '
        'conductivity_1 = "45 W/(m*K)", conductivity_2 = "50 W/(m*K)", roughness_1 = "3 um", roughness_2 = "2 um", '
        "slope_1 = 0.15, slope_2 = 0.12 }} }}"
    )
    old = 'surfaces = ["bed.z_max", "block.z_min"]\nconductance = "5000 W/(m^2*K)"'
    found = []
    for gain in ("", ", gain = 1.7"):
        new = 'surfaces = ["bed.z_max", "block.z_min"]\n' + law.format(gain=gain)
        machine = load_machine(descriptions.edited(tmp_path, (old, new)))
        found.append(joint_conductance("block", machine))
        p = by_path(machine)["contacts.block.joint.gain"]
        assert (p.kind, p.unit, p.nominal) == ("joint", "1", machine.contacts["block"].joint.gain)
        assert "contacts.block.conductance" not in by_path(machine)
    assert found[1] == pytest.approx(1.7 * found[0], rel=1e-14)


def test_later_tables_win_and_what_they_leave_out_stays(tmp_path):
    tables = (
        declared("*", "fixed = true")
        + declared("contacts.*.total", 'tolerance = "10 %"\nlow = "2 W/K"')
        + declared("contacts.front_*", "tolerance = 0.5")
        + declared("contacts.rear_inner.total", "fixed = true")
        + declared("environment.*.offset", 'tolerance = "200 mK"\nhigh = "1 K"')
        + declared("tcp.expansion.bed.x", 'tolerance = "0.1 um/K"')
    )
    found = by_path(load_machine(with_tables(tmp_path, tables)))
    assert {path.partition(".")[0] for path in found} == {"contacts", "environment", "tcp"}
    assert "contacts.rear_inner.total" not in found
    assert found["contacts.flange.total"].sigma == pytest.approx(math.log(1.1))
    front = found["contacts.front_outer.total"]
    assert (front.sigma, front.low, front.high) == pytest.approx((math.log(1.5), 2.0, 70.0))
    shop = found["environment.shop.offset"]
    assert (shop.sigma, shop.low, shop.high) == pytest.approx((0.2, -3.0, 1.0))
    assert found["tcp.expansion.bed.x"].sigma == pytest.approx(1e-7)
    assert list(found) == [path for path in parameter_units(load_machine(lumped.SPINDLE)) if path in found]


def test_a_share_of_an_expansion_is_one_of_the_node_s_largest_component(tmp_path):
    """As its default is, so that a component of nought may be unsure, too; whatever an earlier table says."""
    tables = declared("tcp.expansion.*", 'tolerance = "0.2 um/K"') + declared(
        "tcp.expansion.housing.*", 'tolerance = "8 %"'
    )
    found = by_path(load_machine(with_tables(tmp_path, tables)))
    assert found["tcp.expansion.housing.x"].sigma == pytest.approx(0.08 * 1.1e-6)  # -0.8 um/K beside 1.1 um/K
    assert found["tcp.expansion.housing.y"].sigma == pytest.approx(0.08 * 1.1e-6)
    assert found["tcp.expansion.bed.z"].sigma == pytest.approx(0.2e-6)


def test_constant_environments_and_zero_rows_are_fitted_where_a_table_names_them(tmp_path):
    path = descriptions.edited(tmp_path, ("[poses]", declared("environment.floor.offset") + "\n[poses]"))
    assert by_path(load_machine(path))["environment.floor.offset"].sigma == 0.5
    zero = ("shaft = [", "nut = [0.0, 0.0, 0.0]\nshaft = [")
    assert "tcp.expansion.nut.x" not in by_path(load_machine(with_tables(tmp_path, "", zero)))
    named = declared("tcp.expansion.nut.x", 'tolerance = "1 um/K"')
    p = by_path(load_machine(with_tables(tmp_path, named, zero)))["tcp.expansion.nut.x"]
    assert (p.sigma, p.low, p.high) == pytest.approx((1e-6, -1e-5, 1e-5))


def test_a_gain_of_zero_is_no_parameter(tmp_path):
    zero = ('signals = { current = "spindle_current" }', 'signals = { current = "spindle_current" }\ngain = 0')
    assert "sources.motor.gain" not in by_path(load_machine(with_tables(tmp_path, "", zero)))
    wild = with_tables(tmp_path, declared("sources.*.gain", "tolerance = 0.1"), zero)
    assert {p for p in by_path(load_machine(wild)) if p.startswith("sources")} == {
        "sources.front.gain", "sources.rear.gain", "sources.nut.gain",
    }  # fmt: skip
    with pytest.raises(DescriptionError, match=r"sources\.motor\.gain is 0"):
        load_machine(with_tables(tmp_path, declared("sources.motor.gain"), zero))


@pytest.mark.parametrize(
    ("table", "key", "says", "remedy"),
    [
        ('path = "sources.motr.gain"', "path", "no parameter", "'sources.motor.gain'"),
        ('path = "sources.*.gian"', "path", "no parameter", "'sources.*.gain'"),
        ('path = "materials.steel.conductivity"', "path", "no parameter", "'materials.steel.heat_capacity'"),
        ('path = "tcp.expansion.shaft"', "path", "no parameter", "'tcp.expansion.shaft."),
        ('path = "sources.motor.gain"\ntolerance = "0.5 K"', "tolerance", "not relative", "30 %"),
        ('path = "sources.motor.gain"\ntolerance = 30', "tolerance", "3000 %", "30 %"),
        ('path = "sources.motor.gain"\ntolerance = 0', "tolerance", "a tolerance of 0", "fixed = true"),
        ('path = "environment.*.offset"\ntolerance = "30 %"', "tolerance", "not a quantity in K", "0.5 K"),
        ('path = "tcp.expansion.*"\ntolerance = 0.3', "tolerance", "0.3 m/K", "1 um/K"),
        ('path = "tcp.expansion.shaft.*"\ntolerance = "-8 %"', "tolerance", "a tolerance of -2.56e-07 m/K", "1 um/K"),
        ('path = "sources.motor.gain"\nlow = 2\nhigh = 1.5', "low", "are empty", "low < high"),
        ('path = "sources.motor.gain"\nlow = 1.5', "low", "outside its bounds", "widen"),
        ('path = "sources.motor.gain"\nhigh = 0.5', "high", "outside its bounds", "widen"),
        ('path = "sources.motor.gain"\nlow = -2', "low", "include zero", "side of 1"),
        ('path = "contacts.*.total"\nlow = "1 W/(m^2*K)"', "low", "not a quantity in W/K", "14 W/K"),
        ('path = "nodes.bed.capacity"\nhigh = "200 kJ/K"\nlow = "190 kJ/K"', "low", "180000 J/K", "widen"),
        ("path = 3", "path", "valid string", "sources.*.gain"),
        ('pth = "sources.*.gain"', "pth", "unknown key", "'path'"),
        ('path = "*"\nfixed = "often"', "fixed", "boolean", "true"),
    ],
)
def test_each_mistake_is_one_problem_at_its_line(tmp_path, table, key, says, remedy):
    """Behind a sound table, so that the line is that of the second."""
    path = with_tables(tmp_path, declared("films.*.gain", "tolerance = 0.2") + f"\n[[parameters]]\n{table}\n")
    with pytest.raises(DescriptionError) as caught:
        load_machine(path)
    (problem,) = caught.value.problems
    assert f"parameters.1.{key} (line" in problem.where
    number = int(problem.where.rpartition("line ")[2].rstrip(")"))
    assert path.read_text(encoding="utf-8").splitlines()[number - 1].startswith(key)
    assert says in problem.what
    assert remedy in problem.remedy


def test_a_table_without_brackets_is_described(tmp_path):
    with pytest.raises(DescriptionError) as caught:
        load_machine(with_tables(tmp_path, '\n[parameters]\npath = "sources.*.gain"\n'))
    (problem,) = caught.value.problems
    assert "[[parameters]]" in problem.remedy
