"""Every cause of the catalogue as text: the description stays sound and means what the cause says."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.support.descriptions import MACHINES
from twin.cli.main import run as command
from twin.diagnose.diagnosis import Cause, Window
from twin.diagnose.edits import EDITS, extended_description, loads_with
from twin.errors import DescriptionError
from twin.logs.run import Run, Table
from twin.machine.description import Machine
from twin.machine.explain import explain, load_of
from twin.machine.extend import removed
from twin.machine.load import load_machine

FILES = {path.parent.name: path for path in MACHINES}
TEXTS = {name: path.read_text(encoding="utf-8") for name, path in FILES.items()}
DAY = (Window("run_1", 3600.0, 7200.0), Window("run_2", 0.0, 600.0, 0.5))


def cause(family: str, place: str, amplitude: float, unit: str = "1", **more) -> Cause:
    return Cause(family, place, "", amplitude, (amplitude, amplitude), unit, 50.0, 20.0, **more)


def extended(name: str, *causes: Cause) -> Machine:
    """The machine with causes; loading it is half of each test."""
    edit = extended_description(TEXTS[name], causes)
    assert removed(edit.text) == TEXTS[name]
    return load_machine(FILES[name], edit.text)


def heat(machine: Machine, name: str, **settings: str) -> float:
    """W of a source at the upper bounds of the signals."""
    return float(explain(machine, f"sources.{name}", load_of(machine, settings)).value[0])


def film(machine: Machine, name: str, **settings: str) -> float:
    return float(explain(machine, f"films.{name}", load_of(machine, settings)).value[0])


@pytest.mark.parametrize(
    ("name", "one"),
    [
        ("slide", cause("film_gain", "films.floor", 3.0)),
        ("slide", cause("film_gain", "bed.y_min", 12.0, "W/(m^2*K)")),
        ("slide", cause("forced_convection", "slide.z_max", 9.0, "W/(m^2*K)", signal="x_speed", exponent=0.8)),
        ("slide", cause("heat_source", "bed.x_max", 12.0, "W")),
        ("slide", cause("heat_source", "bed.x_max", 12.0, "W", windows=DAY)),
        ("slide", cause("loss_law", "sources.x_motor", 2.0)),
        ("slide", cause("joint", "contacts.screw_end", 0.2)),
        ("slide", cause("zone", "environment.shop", -2.0, "K")),
        ("slide", cause("sun", "bed.y_max", 30.0, "W", windows=DAY)),
        ("slide", cause("coolant", "block.y_min", 200.0, "W/(m^2*K)", settings={"temperature": 15.0})),
        ("slide", cause("signal", "signals.x_current", 2.0, history="factor")),
        ("slide", cause("scale_expansion", "axes.x", 8e-6, "1/K")),
        ("slide", cause("expansion", "parts.bed", 1.2)),
        ("slide", cause("capacity", "bed.z_max", 5e3, "J/K", settings={"conductance": 10.0})),
        ("slide", cause("misplaced_source", "sources.x_motor", 1.0, settings={"surface": "bed.x_min"})),
        ("five_axis", cause("film_gain", "films.bed", 3.0)),
        ("five_axis", cause("film_gain", "bed.x_motor", 12.0, "W/(m^2*K)")),
        ("five_axis", cause("forced_convection", "column.back", 9.0, "W/(m^2*K)", signal="x_speed")),
        ("five_axis", cause("heat_source", "column.pad_1", 12.0, "W", signal="spindle_speed", exponent=1.5)),
        ("five_axis", cause("heat_source", "contacts.x_guide", 12.0, "W", signal="x_speed", exponent=2.0)),
        ("five_axis", cause("loss_law", "sources.x_guide", 100.0, "W", signal="x_speed", exponent=2.0)),
        ("five_axis", cause("joint", "contacts.x_guide", 0.2, windows=DAY)),
        ("five_axis", cause("zone", "environment.room", 1.5, "K/m", settings={"height": 0.5})),
        ("five_axis", cause("sun", "column.left", 30.0, "W", windows=DAY)),
        ("five_axis", cause("coolant", "headstock.top", 200.0, "W/(m^2*K)", windows=DAY, settings={"temperature": 15})),
        ("five_axis", cause("signal", "signals.spindle_speed", 60.0, history="factor")),
        ("five_axis", cause("scale_expansion", "axes.y", 8e-6, "1/K", settings={"surface": "column.back"})),
        ("five_axis", cause("expansion", "materials.steel", 0.9)),
        ("five_axis", cause("capacity", "table.top", 5e3, "J/K")),
        ("five_axis", cause("misplaced_source", "sources.y_motor", 1.0, settings={"surface": "column.back"})),
    ],
    ids=lambda value: f"{value.family}-{value.place}" if isinstance(value, Cause) else value,
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
        (cause("film_gain", "films.floor", 3.0), "films.floor.gain"),
        (cause("coolant", "bed.y_min", 9.0, windows=DAY, settings={"temperature": 15}), "films.found_1.gain"),
        (cause("heat_source", "bed.y_min", 9.0, windows=DAY), "sources.found_1.gain"),
        (cause("joint", "contacts.nut", 2.0, windows=DAY), "contacts.nut.switched"),
        (cause("zone", "environment.shop", 2.0, "K/m", settings={"height": 0.5}), "environment.shop.gradient"),
        (cause("expansion", "parts.bed", 1.1), "materials.found_1.expansion"),
        (cause("sensor", "sensors.block", 1.0), ""),
    ],
    ids=lambda value: value.family if isinstance(value, Cause) else None,
)
def test_the_path_of_what_a_cause_amounts_to(one, path):
    assert extended_description(TEXTS["slide"], [one]).parameters == (path,)


@pytest.mark.parametrize("family", ["sensor", "slip", "initial_state", "coarse_model", "measurement", "not_thermal"])
def test_what_is_no_fault_of_the_description_leaves_it(family):
    edit = extended_description(TEXTS["slide"], [cause(family, "sensors.block", 1.0, history="offset")])
    assert (edit.text, edit.signals) == (TEXTS["slide"], {})


def test_every_family_has_its_row():
    assert list(EDITS) == [
        "film_gain", "forced_convection", "heat_source", "loss_law", "joint", "zone", "sun", "coolant", "sensor",
        "signal", "scale_expansion", "expansion", "slip", "capacity", "initial_state", "coarse_model", "measurement",
        "misplaced_source", "not_thermal",
    ]  # fmt: skip


def test_heat_is_what_it_says():
    assert heat(extended("slide", cause("heat_source", "bed.x_max", 12.0, "W")), "found_1") == pytest.approx(12.0)
    switched = extended("slide", cause("heat_source", "bed.x_max", 12.0, "W", windows=DAY))
    assert heat(switched, "found_1", found_1="0.25") == pytest.approx(3.0)
    by_current = extended("slide", cause("heat_source", "bed.x_max", 12.0, "W", signal="x_current", exponent=2.0))
    assert by_current.sources["found_1"].law == "motor_copper"
    assert heat(by_current, "found_1", x_current="6 A") == pytest.approx(3.0, rel=1e-4)  # half the largest
    reference = {"reference": 0.1}
    by_speed = extended(
        "slide", cause("heat_source", "bed.x_max", 12.0, "W", signal="x_speed", exponent=1.5, settings=reference)
    )
    assert heat(by_speed, "found_1", x_speed="-0.4 m/s") == pytest.approx(12.0 * 4.0**1.5)
    by_turns = extended("five_axis", cause("heat_source", "spindle.neck", 12.0, "W", signal="spindle_speed"))
    assert by_turns.sources["found_1"].law == "turning_heat"
    assert heat(by_turns, "found_1", spindle_speed="5000 1/min") == pytest.approx(6.0, rel=1e-5)


def test_heat_at_a_moving_contact_goes_into_its_pads():
    source = extended("slide", cause("heat_source", "contacts.x_guide", 12.0, "W")).sources["found_1"]
    assert (source.contact, source.surface, source.rail_share) == ("x_guide", None, 0.0)


def test_a_loss_of_another_shape_takes_the_place_of_the_old_one():
    one = cause("loss_law", "sources.x_guide", 80.0, "W", signal="x_speed", exponent=2.0, settings={"gain": 0.25})
    machine = extended("five_axis", one)
    assert machine.sources["x_guide"].gain == 0.25
    new = machine.sources["found_1"]
    assert (new.law, new.contact, new.rail_share) == ("speed_heat", "x_guide", 0.5)
    assert heat(machine, "found_1", x_speed="0.3 m/s") == pytest.approx(20.0)
    assert extended("slide", cause("loss_law", "sources.x_nut", 1.5)).sources["x_nut"].gain == 1.5


def test_films_lie_on_top_in_the_air_of_their_surface():
    machine = extended("five_axis", cause("film_gain", "headstock.top", 12.0, "W/(m^2*K)"))
    assert (machine.films["found_1"].environment, machine.films["found_1"].additional) == ("enclosure", True)
    assert film(machine, "found_1") == pytest.approx(12.0)
    pads = extended("five_axis", cause("film_gain", "contacts.x_guide", 12.0, "W/(m^2*K)")).films["found_1"]
    assert pads.surfaces == ("column.pad_1", "column.pad_2", "column.pad_3", "column.pad_4")
    assert pads.environment == "room"
    wind = extended(
        "slide", cause("forced_convection", "slide.z_max", 9.0, "W/(m^2*K)", signal="x_speed", exponent=0.5)
    )
    assert film(wind, "found_1", x_speed="0.25 m/s") == pytest.approx(4.5)
    assert film(wind, "found_1", x_speed="0 m/s") == 0.0
    assert extended("five_axis", cause("film_gain", "films.y_motor", 0.5)).films["y_motor"].gain == 7.0


def test_a_medium_has_its_temperature_and_its_valve():
    always = extended("slide", cause("coolant", "block.y_min", 200.0, "W/(m^2*K)", settings={"temperature": 15.0}))
    assert always.environment["found_1"].temperature == 15.0
    assert film(always, "found_1") == pytest.approx(200.0)
    one = cause("coolant", "block.y_min", 200.0, "W/(m^2*K)", windows=DAY, settings={"temperature": 15.0})
    machine = extended("slide", one)
    assert (machine.films["found_1"].law, machine.films["found_1"].environment) == ("switched_film", "found_1")
    assert film(machine, "found_1", found_1="0.5") == pytest.approx(100.0)
    with pytest.raises(DescriptionError, match="temperature of the medium"):
        extended("slide", cause("coolant", "block.y_min", 200.0))


def test_a_film_may_be_switched():
    machine = extended("slide", cause("film_gain", "bed.y_min", 12.0, "W/(m^2*K)", windows=DAY))
    assert film(machine, "found_1", found_1="0.25") == pytest.approx(3.0)
    assert machine.films["found_1"].environment == "shop"


def test_what_is_switched_already_is_not_switched_twice():
    edit = extended_description(TEXTS["slide"], [cause("zone", "environment.shop", -3.0, "K", windows=DAY)])
    with pytest.raises(DescriptionError, match="switched by 'found_1' already"):
        extended_description(edit.text, [cause("zone", "environment.shop", 1.0, "K", windows=DAY)])


def test_joints_and_zones_change_or_are_switched():
    assert extended("slide", cause("joint", "contacts.screw_end", 0.2)).contacts["screw_end"].conductance == 600.0
    switched = extended("slide", cause("joint", "contacts.screw_end", 0.2, windows=DAY)).contacts["screw_end"]
    assert (switched.conductance, switched.switch, switched.switched) == (3000.0, "found_1", 0.2)
    assert extended("spindle", cause("joint", "contacts.front_outer", 0.5)).contacts["front_outer"].total == 7.0
    assert extended("slide", cause("zone", "environment.shop", -2.0, "K")).environment["shop"].offset == -2.0
    door = extended("slide", cause("zone", "environment.shop", -3.0, "K", windows=DAY)).environment["shop"]
    assert (door.switch, door.switched_offset, door.offset) == ("found_1", -3.0, 0.0)
    air = extended("slide", cause("zone", "environment.shop", 2.0, "K/m", settings={"height": 0.1})).environment["shop"]
    assert (air.gradient, air.height) == (2.0, 0.1)


def test_wrong_signals_get_their_declaration_corrected():
    assert (
        extended("slide", cause("signal", "signals.x_current", 2.0, history="factor")).signals["x_current"].factor
        == 2.0
    )
    peak = extended("slide", cause("signal", "signals.x_current", 0.5**0.5, history="factor")).signals["x_current"]
    assert (peak.kind, peak.factor) == ("peak", 1.0)
    assert extended_description(
        TEXTS["slide"], [cause("signal", "signals.x_current", 30.0, "s", history="clock")]
    ).text == TEXTS["slide"]  # fmt: skip


def test_expansions_change_one_material_part_or_scale():
    assert extended("slide", cause("expansion", "materials.steel", 1.1)).materials["steel"].expansion == pytest.approx(
        1.1 * 11.5e-6
    )
    machine = extended("slide", cause("expansion", "parts.bed", 1.2))
    assert (machine.parts["bed"].material, machine.parts["slide"].material) == ("found_1", "cast_iron")
    copy, old = machine.materials["found_1"], machine.materials["cast_iron"]
    assert copy == old.model_copy(update={"expansion": 12e-6})
    scale = extended("slide", cause("scale_expansion", "axes.x", 8e-6, "1/K")).scales["found_1"]
    assert (scale.axis, scale.surface, scale.expansion, scale.fixed_at) == ("x", "rail_1.z_max", 8e-6, 0.0)
    scale = extended("slide", cause("scale_expansion", "bed.y_min", 8e-6, "1/K")).scales["found_1"]
    assert (scale.axis, scale.surface) == ("x", "bed.y_min")


def test_a_tank_and_a_source_elsewhere():
    tank = extended("slide", cause("capacity", "bed.z_max", 5e3, "J/K", settings={"conductance": 10.0})).tanks[
        "found_1"
    ]
    assert (tank.surface, tank.capacity, tank.conductance) == ("bed.z_max", 5e3, 10.0)
    moved = cause("misplaced_source", "sources.x_motor", 1.0, settings={"surface": "bed.x_min"})
    assert extended("slide", moved).sources["x_motor"].surface == "bed.x_min"
    with pytest.raises(DescriptionError, match="moving contact"):
        extended("slide", cause("misplaced_source", "sources.x_nut", 1.0, settings={"surface": "bed.x_min"}))


def test_several_causes_get_several_names_and_one_block():
    causes = [
        cause("heat_source", "bed.x_max", 12.0, "W", windows=DAY),
        cause("film_gain", "films.floor", 3.0),
        cause("heat_source", "bed.x_min", 4.0, "W"),
    ]
    edit = extended_description(TEXTS["slide"], causes)
    machine = load_machine(FILES["slide"], edit.text)
    assert [n for n in machine.sources if n.startswith("found")] == ["found_1", "found_2"]
    assert edit.text.count("# --- found by twin diagnose ---") == 1
    again = extended_description(edit.text, [cause("capacity", "bed.z_max", 5e3, "J/K")])
    assert list(load_machine(FILES["slide"], again.text).tanks) == ["found_3"]


def test_lumped_machines_have_nodes_for_surfaces():
    machine = extended(
        "spindle", cause("heat_source", "housing", 12.0, "W"), cause("film_gain", "housing", 5.0, "W/(m^2*K)")
    )
    assert machine.sources["found_1"].surface == "housing"
    assert machine.films["found_2"].surfaces == ("housing",)


@pytest.mark.parametrize(
    ("one", "told"),
    [
        (cause("heat_source", "bde.x_max", 12.0), "did you mean 'bed.x_max'"),
        (cause("heat_source", "bed.xmax", 12.0), "did you mean 'bed.x_max'"),
        (cause("heat_source", "bed", 12.0), "no such surface"),
        (cause("heat_source", "bed.x_max", 12.0, signal="x_curent"), "did you mean 'x_current'"),
        (cause("heat_source", "bed.x_max", 12.0, signal="shop_air"), "no law heats"),
        (cause("heat_source", "bed.x_max", -12.0, "W"), "outside 0"),
        (cause("film_gain", "films.flor", 2.0), "did you mean 'films.floor'"),
        (cause("zone", "films.flor", 2.0, "K"), "did you mean 'films.floor'"),
        (cause("forced_convection", "bed.x_max", 2.0, signal="x_current"), "speed in m/s"),
        (cause("sun", "bed.x_max", 2.0), "profile"),
        (cause("capacity", "bed.x_max", 5e3, "J/K", windows=DAY), "without windows"),
        (cause("loss_law", "sources.x_nut", 2.0, windows=DAY), "without windows"),
        (cause("heat_sorce", "bed.x_max", 2.0), "did you mean 'heat_source'"),
    ],
)
def test_what_cannot_be_written_is_told(one, told):
    with pytest.raises(DescriptionError) as e:
        extended_description(TEXTS["slide"], [one])
    assert told in str(e.value)


def test_levels_above_one_go_into_the_amplitude():
    windows = (Window("a", 0.0, 10.0, 4.0), Window("a", 10.0, 20.0, 1.0))
    edit = extended_description(TEXTS["slide"], [cause("heat_source", "bed.x_max", 3.0, "W", windows=windows)])
    assert heat(load_machine(FILES["slide"], edit.text), "found_1") == pytest.approx(12.0)
    assert [w.level for w in edit.signals["found_1"]] == [1.0, 0.25]
    joint = extended_description(TEXTS["slide"], [cause("joint", "contacts.nut", 1.5, windows=windows)])
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
    machine = extended("slide", cause("zone", "films.floor", 2.0, "K"))
    own = machine.environment[machine.films["floor"].environment]
    assert machine.films["floor"].environment == "found_1"
    assert own.offset == pytest.approx(air.offset + 2.0)
    assert own.signal == air.signal
    others = [n for n in before.films if n != "floor"]
    assert [machine.films[n].environment for n in others] == [before.films[n].environment for n in others]
