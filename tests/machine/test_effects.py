"""Every effect as text: the description stays sound and means what the effect says."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.support.descriptions import MACHINES
from twin.cli.main import run as command
from twin.errors import DescriptionError
from twin.logs.run import Run, Table
from twin.machine.description import Machine
from twin.machine.effects.edits import EDITS, extended_description, loads_with
from twin.machine.effects.effect import Effect, Window
from twin.machine.explain import explain, load_of
from twin.machine.extend import removed
from twin.machine.load import load_machine

FILES = {path.parent.name: path for path in MACHINES}
TEXTS = {name: path.read_text(encoding="utf-8") for name, path in FILES.items()}
DAY = (Window("run_1", 3600.0, 7200.0), Window("run_2", 0.0, 600.0, 0.5))


def effect(family: str, place: str, amplitude: float, unit: str = "1", **more) -> Effect:
    return Effect(family, place, amplitude, unit, **more)


def extended(name: str, *effects: Effect) -> Machine:
    """The machine with effects; loading it is half of each test."""
    edit = extended_description(TEXTS[name], effects)
    assert removed(edit.text) == TEXTS[name]
    return load_machine(FILES[name], edit.text)


def heat(machine: Machine, name: str, **settings: str) -> float:
    """W of a source at the upper bounds of the signals."""
    return float(explain(machine, f"sources.{name}", load_of(machine, settings)).value[0])


def film(machine: Machine, name: str, **settings: str) -> float:
    return float(explain(machine, f"films.{name}", load_of(machine, settings)).value[0])


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "one"),
    [
        ("slide", effect("film_gain", "films.floor", 3.0)),
        ("slide", effect("film_gain", "bed.y_min", 12.0, "W/(m^2*K)")),
        ("slide", effect("forced_convection", "slide.z_max", 9.0, "W/(m^2*K)", signal="x_speed", exponent=0.8)),
        ("slide", effect("heat_source", "bed.x_max", 12.0, "W")),
        ("slide", effect("heat_source", "bed.x_max", 12.0, "W", windows=DAY)),
        ("slide", effect("loss_law", "sources.x_motor", 2.0)),
        ("slide", effect("joint", "contacts.screw_end", 0.2)),
        ("slide", effect("zone", "environment.shop", -2.0, "K")),
        ("slide", effect("sun", "bed.y_max", 30.0, "W", windows=DAY)),
        ("slide", effect("coolant", "block.y_min", 200.0, "W/(m^2*K)", settings={"temperature": 15.0})),
        ("slide", effect("signal", "signals.x_current", 2.0, history="factor")),
        ("slide", effect("scale_expansion", "axes.x", 8e-6, "1/K")),
        ("slide", effect("expansion", "parts.bed", 1.2)),
        ("slide", effect("capacity", "bed.z_max", 5e3, "J/K", settings={"conductance": 10.0})),
        ("slide", effect("misplaced_source", "sources.x_motor", 1.0, settings={"surface": "bed.x_min"})),
        ("five_axis", effect("film_gain", "films.bed", 3.0)),
        ("five_axis", effect("film_gain", "bed.x_motor", 12.0, "W/(m^2*K)")),
        ("five_axis", effect("forced_convection", "column.back", 9.0, "W/(m^2*K)", signal="x_speed")),
        ("five_axis", effect("heat_source", "column.pad_1", 12.0, "W", signal="spindle_speed", exponent=1.5)),
        ("five_axis", effect("heat_source", "contacts.x_guide", 12.0, "W", signal="x_speed", exponent=2.0)),
        ("five_axis", effect("loss_law", "sources.x_guide", 100.0, "W", signal="x_speed", exponent=2.0)),
        ("five_axis", effect("joint", "contacts.x_guide", 0.2, windows=DAY)),
        ("five_axis", effect("zone", "environment.room", 1.5, "K/m", settings={"height": 0.5})),
        ("five_axis", effect("sun", "column.left", 30.0, "W", windows=DAY)),
        (
            "five_axis",
            effect("coolant", "headstock.top", 200.0, "W/(m^2*K)", windows=DAY, settings={"temperature": 15}),
        ),
        ("five_axis", effect("signal", "signals.spindle_speed", 60.0, history="factor")),
        ("five_axis", effect("scale_expansion", "axes.y", 8e-6, "1/K", settings={"surface": "column.back"})),
        ("five_axis", effect("expansion", "materials.steel", 0.9)),
        ("five_axis", effect("capacity", "table.top", 5e3, "J/K")),
        ("five_axis", effect("misplaced_source", "sources.y_motor", 1.0, settings={"surface": "column.back"})),
    ],
    ids=lambda value: f"{value.family}-{value.place}" if isinstance(value, Effect) else value,
)  # fmt: skip
def test_the_edited_description_is_sound_and_another_one(name, one):
    before = load_machine(FILES[name])
    after = extended(name, one)
    assert after.model_dump() != before.model_dump()
    edit = extended_description(TEXTS[name], [one], "hidden")
    assert removed(edit.text) == TEXTS[name]
    if one.windows:
        assert edit.signals == {"hidden_1": one.windows}
        entry = load_machine(FILES[name], edit.text).signals["hidden_1"]
        assert (entry.unit, entry.range, entry.default) == ("1", (0.0, 1.0), 0.0)
    else:
        assert edit.signals == {}


@pytest.mark.parametrize(
    ("one", "path"),
    [
        (effect("film_gain", "films.floor", 3.0), "films.floor.gain"),
        (effect("coolant", "bed.y_min", 9.0, windows=DAY, settings={"temperature": 15}), "films.found_1.gain"),
        (effect("heat_source", "bed.y_min", 9.0, windows=DAY), "sources.found_1.gain"),
        (effect("joint", "contacts.nut", 2.0, windows=DAY), "contacts.nut.switched"),
        (effect("zone", "environment.shop", 2.0, "K/m", settings={"height": 0.5}), "environment.shop.gradient"),
        (effect("expansion", "parts.bed", 1.1), "materials.found_1.expansion"),
        (effect("sensor", "sensors.block", 1.0), ""),
    ],
    ids=lambda value: value.family if isinstance(value, Effect) else None,
)
def test_the_path_of_what_an_effect_amounts_to(one, path):
    assert extended_description(TEXTS["slide"], [one]).parameters == (path,)


@pytest.mark.parametrize("family", ["sensor", "slip", "initial_state", "coarse_model", "measurement", "not_thermal"])
def test_what_is_no_fault_of_the_description_leaves_it(family):
    edit = extended_description(TEXTS["slide"], [effect(family, "sensors.block", 1.0, history="offset")])
    assert (edit.text, edit.signals) == (TEXTS["slide"], {})


def test_every_family_has_its_row():
    assert list(EDITS) == [
        "film_gain", "forced_convection", "heat_source", "loss_law", "joint", "zone", "sun", "coolant", "sensor",
        "signal", "scale_expansion", "expansion", "slip", "capacity", "initial_state", "coarse_model", "measurement",
        "misplaced_source", "not_thermal", "missing_joint",
    ]  # fmt: skip


def test_heat_is_what_it_says():
    assert heat(extended("slide", effect("heat_source", "bed.x_max", 12.0, "W")), "found_1") == pytest.approx(12.0)
    switched = extended("slide", effect("heat_source", "bed.x_max", 12.0, "W", windows=DAY))
    assert heat(switched, "found_1", found_1="0.25") == pytest.approx(3.0)
    by_current = extended("slide", effect("heat_source", "bed.x_max", 12.0, "W", signal="x_current", exponent=2.0))
    assert by_current.sources["found_1"].law == "motor_copper"
    assert heat(by_current, "found_1", x_current="6 A") == pytest.approx(3.0, rel=1e-4)  # half the largest
    reference = {"reference": 0.1}
    by_speed = extended(
        "slide", effect("heat_source", "bed.x_max", 12.0, "W", signal="x_speed", exponent=1.5, settings=reference)
    )
    assert heat(by_speed, "found_1", x_speed="-0.4 m/s") == pytest.approx(12.0 * 4.0**1.5)
    by_turns = extended("five_axis", effect("heat_source", "spindle.neck", 12.0, "W", signal="spindle_speed"))
    assert by_turns.sources["found_1"].law == "turning_heat"
    assert heat(by_turns, "found_1", spindle_speed="5000 1/min") == pytest.approx(6.0, rel=1e-5)


def test_heat_at_a_moving_contact_goes_into_its_pads():
    source = extended("slide", effect("heat_source", "contacts.x_guide", 12.0, "W")).sources["found_1"]
    assert (source.contact, source.surface, source.rail_share) == ("x_guide", None, 0.0)


def test_a_loss_of_another_shape_takes_the_place_of_the_old_one():
    one = effect("loss_law", "sources.x_guide", 80.0, "W", signal="x_speed", exponent=2.0, settings={"gain": 0.25})
    machine = extended("five_axis", one)
    assert machine.sources["x_guide"].gain == 0.25
    new = machine.sources["found_1"]
    assert (new.law, new.contact, new.rail_share) == ("speed_heat", "x_guide", 0.5)
    assert heat(machine, "found_1", x_speed="0.3 m/s") == pytest.approx(20.0)
    assert extended("slide", effect("loss_law", "sources.x_nut", 1.5)).sources["x_nut"].gain == 1.5


def test_films_lie_on_top_in_the_air_of_their_surface():
    machine = extended("five_axis", effect("film_gain", "headstock.top", 12.0, "W/(m^2*K)"))
    assert (machine.films["found_1"].environment, machine.films["found_1"].additional) == ("enclosure", True)
    assert film(machine, "found_1") == pytest.approx(12.0)
    pads = extended("five_axis", effect("film_gain", "contacts.x_guide", 12.0, "W/(m^2*K)")).films["found_1"]
    assert pads.surfaces == ("column.pad_1", "column.pad_2", "column.pad_3", "column.pad_4")
    assert pads.environment == "room"
    wind = extended(
        "slide", effect("forced_convection", "slide.z_max", 9.0, "W/(m^2*K)", signal="x_speed", exponent=0.5)
    )
    assert film(wind, "found_1", x_speed="0.25 m/s") == pytest.approx(4.5)
    assert film(wind, "found_1", x_speed="0 m/s") == 0.0
    assert extended("five_axis", effect("film_gain", "films.y_motor", 0.5)).films["y_motor"].gain == 7.0


def test_a_medium_has_its_temperature_and_its_valve():
    always = extended("slide", effect("coolant", "block.y_min", 200.0, "W/(m^2*K)", settings={"temperature": 15.0}))
    assert always.environment["found_1"].temperature == 15.0
    assert film(always, "found_1") == pytest.approx(200.0)
    one = effect("coolant", "block.y_min", 200.0, "W/(m^2*K)", windows=DAY, settings={"temperature": 15.0})
    machine = extended("slide", one)
    assert (machine.films["found_1"].law, machine.films["found_1"].environment) == ("switched_film", "found_1")
    assert film(machine, "found_1", found_1="0.5") == pytest.approx(100.0)
    with pytest.raises(DescriptionError, match="temperature of the medium"):
        extended("slide", effect("coolant", "block.y_min", 200.0))


def test_a_film_may_be_switched():
    machine = extended("slide", effect("film_gain", "bed.y_min", 12.0, "W/(m^2*K)", windows=DAY))
    assert film(machine, "found_1", found_1="0.25") == pytest.approx(3.0)
    assert machine.films["found_1"].environment == "shop"


def test_what_is_switched_already_is_not_switched_twice():
    edit = extended_description(TEXTS["slide"], [effect("zone", "environment.shop", -3.0, "K", windows=DAY)])
    with pytest.raises(DescriptionError, match="switched by 'found_1' already"):
        extended_description(edit.text, [effect("zone", "environment.shop", 1.0, "K", windows=DAY)])


def test_joints_and_zones_change_or_are_switched():
    assert extended("slide", effect("joint", "contacts.screw_end", 0.2)).contacts["screw_end"].conductance == 600.0
    switched = extended("slide", effect("joint", "contacts.screw_end", 0.2, windows=DAY)).contacts["screw_end"]
    assert (switched.conductance, switched.switch, switched.switched) == (3000.0, "found_1", 0.2)
    assert extended("spindle", effect("joint", "contacts.front_outer", 0.5)).contacts["front_outer"].total == 7.0
    assert extended("slide", effect("zone", "environment.shop", -2.0, "K")).environment["shop"].offset == -2.0
    door = extended("slide", effect("zone", "environment.shop", -3.0, "K", windows=DAY)).environment["shop"]
    assert (door.switch, door.switched_offset, door.offset) == ("found_1", -3.0, 0.0)
    higher = effect("zone", "environment.shop", 2.0, "K/m", settings={"height": 0.1})
    air = extended("slide", higher).environment["shop"]
    assert (air.gradient, air.height) == (2.0, 0.1)


def test_wrong_signals_get_their_declaration_corrected():
    assert (
        extended("slide", effect("signal", "signals.x_current", 2.0, history="factor")).signals["x_current"].factor
        == 2.0
    )
    peak = extended("slide", effect("signal", "signals.x_current", 0.5**0.5, history="factor")).signals["x_current"]
    assert (peak.kind, peak.factor) == ("peak", 1.0)
    assert extended_description(
        TEXTS["slide"], [effect("signal", "signals.x_current", 30.0, "s", history="clock")]
    ).text == TEXTS["slide"]  # fmt: skip


def test_expansions_change_one_material_part_or_scale():
    assert extended("slide", effect("expansion", "materials.steel", 1.1)).materials["steel"].expansion == pytest.approx(
        1.1 * 11.5e-6
    )
    machine = extended("slide", effect("expansion", "parts.bed", 1.2))
    assert (machine.parts["bed"].material, machine.parts["slide"].material) == ("found_1", "cast_iron")
    copy, old = machine.materials["found_1"], machine.materials["cast_iron"]
    assert copy == old.model_copy(update={"expansion": 12e-6})
    scale = extended("slide", effect("scale_expansion", "axes.x", 8e-6, "1/K")).scales["found_1"]
    assert (scale.axis, scale.surface, scale.expansion, scale.fixed_at) == ("x", "rail_1.z_max", 8e-6, 0.0)
    scale = extended("slide", effect("scale_expansion", "bed.y_min", 8e-6, "1/K")).scales["found_1"]
    assert (scale.axis, scale.surface) == ("x", "bed.y_min")


def test_numbers_of_a_node_are_multiplied_in_place():
    before = load_machine(FILES["spindle"], TEXTS["spindle"])
    machine = extended("spindle", effect("expansion", "tcp.expansion.shaft", 1.5), effect("capacity", "bed", 1.6))
    assert machine.tcp.expansion["shaft"] == pytest.approx([1.5 * v for v in before.tcp.expansion["shaft"]])
    assert machine.nodes["bed"].capacity == pytest.approx(1.6 * before.nodes["bed"].capacity)
    assert machine.tanks == before.tanks
    heavier = extended("spindle", effect("capacity", "bed", 5e3, "J/K"))
    assert heavier.tanks["found_1"].capacity == 5e3
    assert heavier.nodes == before.nodes
    for wrong, told in (
        (effect("expansion", "tcp.expansion.shaf", 1.5), "did you mean 'shaft'"),
        (effect("capacity", "bde", 1.6), "did you mean 'bed'"),
    ):
        with pytest.raises(DescriptionError, match=told):
            extended("spindle", wrong)


def test_a_tank_and_a_source_elsewhere():
    tank = extended("slide", effect("capacity", "bed.z_max", 5e3, "J/K", settings={"conductance": 10.0})).tanks[
        "found_1"
    ]
    assert (tank.surface, tank.capacity, tank.conductance) == ("bed.z_max", 5e3, 10.0)
    moved = effect("misplaced_source", "sources.x_motor", 1.0, settings={"surface": "bed.x_min"})
    assert extended("slide", moved).sources["x_motor"].surface == "bed.x_min"
    with pytest.raises(DescriptionError, match="moving contact"):
        extended("slide", effect("misplaced_source", "sources.x_nut", 1.0, settings={"surface": "bed.x_min"}))


def test_several_effects_get_several_names_and_one_block():
    effects = [
        effect("heat_source", "bed.x_max", 12.0, "W", windows=DAY),
        effect("film_gain", "films.floor", 3.0),
        effect("heat_source", "bed.x_min", 4.0, "W"),
    ]
    edit = extended_description(TEXTS["slide"], effects)
    machine = load_machine(FILES["slide"], edit.text)
    assert [n for n in machine.sources if n.startswith("found")] == ["found_1", "found_2"]
    assert edit.text.count("# --- found by twin diagnose ---") == 1
    again = extended_description(edit.text, [effect("capacity", "bed.z_max", 5e3, "J/K")])
    assert list(load_machine(FILES["slide"], again.text).tanks) == ["found_3"]


def test_lumped_machines_have_nodes_for_surfaces():
    machine = extended(
        "spindle", effect("heat_source", "housing", 12.0, "W"), effect("film_gain", "housing", 5.0, "W/(m^2*K)")
    )
    assert machine.sources["found_1"].surface == "housing"
    assert machine.films["found_2"].surfaces == ("housing",)


@pytest.mark.parametrize(
    ("one", "told"),
    [
        (effect("heat_source", "bde.x_max", 12.0), "did you mean 'bed.x_max'"),
        (effect("heat_source", "bed.xmax", 12.0), "did you mean 'bed.x_max'"),
        (effect("heat_source", "bed", 12.0), "no such surface"),
        (effect("heat_source", "bed.x_max", 12.0, signal="x_curent"), "did you mean 'x_current'"),
        (effect("heat_source", "bed.x_max", 12.0, signal="shop_air"), "no law heats"),
        (effect("heat_source", "bed.x_max", -12.0, "W"), "outside 0"),
        (effect("film_gain", "films.flor", 2.0), "did you mean 'films.floor'"),
        (effect("zone", "films.flor", 2.0, "K"), "did you mean 'films.floor'"),
        (effect("forced_convection", "bed.x_max", 2.0, signal="x_current"), "speed in m/s"),
        (effect("sun", "bed.x_max", 2.0), "profile"),
        (effect("capacity", "bed.x_max", 5e3, "J/K", windows=DAY), "without windows"),
        (effect("loss_law", "sources.x_nut", 2.0, windows=DAY), "without windows"),
        (effect("heat_sorce", "bed.x_max", 2.0), "did you mean 'heat_source'"),
    ],
)
def test_what_cannot_be_written_is_told(one, told):
    with pytest.raises(DescriptionError) as e:
        extended_description(TEXTS["slide"], [one])
    assert told in str(e.value)


def test_levels_above_one_go_into_the_amplitude():
    windows = (Window("a", 0.0, 10.0, 4.0), Window("a", 10.0, 20.0, 1.0))
    edit = extended_description(TEXTS["slide"], [effect("heat_source", "bed.x_max", 3.0, "W", windows=windows)])
    assert heat(load_machine(FILES["slide"], edit.text), "found_1") == pytest.approx(12.0)
    assert [w.level for w in edit.signals["found_1"]] == [1.0, 0.25]
    joint = extended_description(TEXTS["slide"], [effect("joint", "contacts.nut", 1.5, windows=windows)])
    assert load_machine(FILES["slide"], joint.text).contacts["nut"].switched == pytest.approx(3.0)


def test_windows_become_columns_of_their_runs():
    loads = Table(np.array([0.0, 10.0, 20.0, 40.0]), {"air": np.full(4, 20.0)}, {"air": "degC"})
    run = Run(loads, folder=Path("runs/a"))
    windows = (Window("a", 5.0, 20.0, 1.0), Window("a", 30.0, 60.0, 0.5), Window("b", 0.0, 100.0))
    out = loads_with(run, {"found_1": windows, "found_2": (Window("", 0.0, np.inf),)})
    assert out.loads.columns["found_1"].tolist() == [0.5, 1.0, 0.25, 0.5]  # shares of the time until the next row
    assert out.loads.columns["found_2"].tolist() == [1.0, 1.0, 1.0, 1.0]
    assert (out.loads.units["found_1"], out.loads.columns["air"].tolist()) == ("1", [20.0] * 4)
    assert "found_1" not in run.loads.columns
    assert loads_with(run, {"found_1": windows}, "b").loads.columns["found_1"].tolist() == [1.0] * 4
    assert loads_with(run, {"found_1": windows}, "a-2").loads.columns["found_1"].tolist() == [0.0] * 4


def test_a_run_that_is_here_has_the_name_of_its_folder(tmp_path, monkeypatch):
    (tmp_path / "day").mkdir()
    monkeypatch.chdir(tmp_path / "day")
    loads = Table(np.array([0.0, 10.0]), {}, {})
    out = loads_with(Run(loads, folder=Path(".")), {"found_1": (Window("day", 0.0, 20.0),)})
    assert out.loads.columns["found_1"].tolist() == [1.0, 1.0]


def test_hidden_in_runs_whose_folders_have_one_name(tmp_path, capsys):
    folder = FILES["spindle"].parent
    arguments = ["hide", "heat_source", "housing", "9 W", str(folder), "-o", str(tmp_path / "out"), "--from", "1 min"]
    runs = [tmp_path / week / "day" for week in "ab"]
    for day in runs:
        shutil.copytree(folder / "runs" / "warm_up", day)
    assert command([*arguments, "--run", str(runs[0]), "--run", str(runs[1])]) == 2
    assert "two runs are called 'day'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_one_film_may_have_air_of_its_own():
    before = load_machine(FILES["slide"])
    air = before.environment[before.films["floor"].environment]
    machine = extended("slide", effect("zone", "films.floor", 2.0, "K"))
    own = machine.environment[machine.films["floor"].environment]
    assert machine.films["floor"].environment == "found_1"
    assert own.offset == pytest.approx(air.offset + 2.0)
    assert own.signal == air.signal
    others = [n for n in before.films if n != "floor"]
    assert [machine.films[n].environment for n in others] == [before.films[n].environment for n in others]
