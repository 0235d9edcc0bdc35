"""Editing a description in place: nothing but the named numbers changes, whatever way they are written."""

from __future__ import annotations

import re
import tomllib

import pytest
import tomlkit
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.descriptions import MACHINES
from twin.errors import DescriptionError
from twin.machine.description import Machine
from twin.machine.edit import edited
from twin.machine.instances import written_out
from twin.machine.load import load_machine
from twin.machine.parameters import parameters
from twin.machine.toml_spans import spans

TEXTS = {path.parent.name: written_out(path.read_text(encoding="utf-8")) for path in MACHINES}
PARAMETERS = {path.parent.name: parameters(load_machine(path)) for path in MACHINES}
NUMBER = re.compile(r"[+-]?\d[\d.]*(?:e[+-]?\d+)?")


def at(machine: Machine, path: str) -> float:
    value = machine
    for key in path.split("."):
        if isinstance(value, tuple):
            value = value["xyz".index(key)]
        else:
            value = value[key] if isinstance(value, dict) else getattr(value, key)
    return value


def pruned(machine: Machine, paths) -> dict:
    """Everything but the values at `paths`."""
    data = machine.model_dump()
    for path in paths:
        keys = path.split(".")
        owner = data
        for key in keys[:-1]:
            owner = owner[key]
        if isinstance(owner, tuple):
            data["tcp"]["expansion"][keys[2]] = tuple(
                None if "xyz"[i] == keys[3] else v for i, v in enumerate(data["tcp"]["expansion"][keys[2]])
            )
        else:
            owner[keys[-1]] = None
    return data


@st.composite
def changes(draw):
    """A machine and new values of some of its parameters, within their bounds."""
    name = draw(st.sampled_from(sorted(TEXTS)))
    chosen = draw(st.lists(st.sampled_from(PARAMETERS[name]), min_size=1, unique_by=lambda p: p.path))
    return name, {p.path: p.value(draw(st.floats(-2, 2).map(lambda c: c or 1.0))) for p in chosen}


@pytest.mark.long
@settings(max_examples=60, deadline=None)
@given(changes())
def test_values_come_back_and_all_else_is_equal(change):
    name, values = change
    before = Machine.model_validate(tomllib.loads(TEXTS[name]))
    text = edited(TEXTS[name], values, digits=17)
    after = Machine.model_validate(tomllib.loads(text))
    for path, value in values.items():
        assert at(after, path) == pytest.approx(value, rel=1e-14, abs=0.0)
    assert pruned(after, values) == pruned(before, values)


@pytest.mark.long
@settings(max_examples=60, deadline=None)
@given(changes())
def test_lines_differ_in_their_numbers_only_and_new_ones_are_gains_and_offsets(change):
    name, values = change
    old, new = TEXTS[name].splitlines(), edited(TEXTS[name], values).splitlines()
    inserted = []
    for line in old:
        while NUMBER.sub("N", new[0]) != NUMBER.sub("N", line):
            inserted.append(new.pop(0))
        new.pop(0)
    assert new == []
    assert all(re.fullmatch(r"(gain|offset) = \S+", line) for line in inserted)
    six = Machine.model_validate(tomllib.loads(edited(TEXTS[name], values)))
    for path, value in values.items():
        assert at(six, path) == pytest.approx(value, rel=5.1e-6)


@settings(max_examples=30, deadline=None)
@given(changes(), st.sampled_from(["calibrated: 0.81 +- 0.03", "guessed"]))
def test_remarks_stand_at_the_end_of_changed_lines_and_no_comment_is_lost(change, remark):
    name, values = change
    old = [line.partition("#")[2].strip() for line in TEXTS[name].splitlines() if "#" in line]
    text = edited(TEXTS[name], values, dict.fromkeys(values, remark))
    new = [line.partition("#")[2].strip() for line in text.splitlines() if "#" in line]
    assert sum(c.count(remark) for c in new) == len(values)
    for comment in old:
        assert any(c.startswith(comment) for c in new)
    bare = [line.partition("#")[0].rstrip() for line in text.splitlines()]
    assert bare == [line.partition("#")[0].rstrip() for line in edited(TEXTS[name], values).splitlines()]


def test_edited_machines_load(tmp_path):
    values = {p.path: p.value(1.0) for p in PARAMETERS["spindle"]}
    path = tmp_path / "machine.toml"
    path.write_text(edited(TEXTS["spindle"], values), encoding="utf-8")
    found = {p.path: p.nominal for p in parameters(load_machine(path))}
    assert found == pytest.approx(values, rel=5.1e-6)


def test_units_and_comments_as_written():
    text = edited(
        TEXTS["spindle"],
        {"contacts.front_outer.total": 27.314159, "nodes.bed.capacity": 171234.5, "materials.steel.expansion": 11.74e-6,
         "tcp.expansion.housing.z": 0.93e-6, "tcp.expansion.housing.x": -0.5e-6, "sources.motor.gain": 0.81},
        {"sources.motor.gain": "calibrated: 0.81 +- 0.03 (was 1)", "tcp.expansion.housing.x": "calibrated: one",
         "tcp.expansion.housing.z": "calibrated: two"},
    )  # fmt: skip
    assert 'total = "27.3142 W/K"' in text
    assert 'capacity = "171.234 kJ/K"' in text
    assert 'expansion = "11.74e-6 1/K"' in text
    assert 'housing = ["-0.5 um/K", "0 um/K", "0.93 um/K"]  # calibrated: one; calibrated: two\n' in text
    motor = text[text.index("[sources.motor]") : text.index("[sources.nut]")]
    assert motor.endswith(
        'signals = { current = "spindle_current" }\ngain = 0.81  # calibrated: 0.81 +- 0.03 (was 1)\n\n'
    )
    again = edited(text, {"sources.motor.gain": 0.79}, {"sources.motor.gain": "calibrated: 0.79 +- 0.02 (was 0.81)"})
    assert "gain = 0.79  # calibrated: 0.79 +- 0.02 (was 0.81)\n" in again


HEAD = """
[machine]
name = "odd"
[materials]
steel = { conductivity = 50, density = 7800, heat_capacity = 500, expansion = 12e-6 } # inline
[nodes]
block.capacity = 1_000 # dotted
block.area = '2 m^2'
base = {capacity = '1.5kJ/K',area = 1}
[environment.air]
temperature = "20 degC" # constant
# the last line of this table
"""
WAYS = {
    "table": '[films.f]\nlaw = "constant_film"\nsurfaces = [ # both\n  "block",\n  "base",\n]\nenvironment = "air"\n'
    "  emissivity = 0.0\n  [films.f.parameters]\n  natural = 5\n\n# --- next ---\n",
    "inline": '[films]\nf = { law = "constant_film", surfaces = ["block", "base"], environment = "air", '
    "emissivity = 0.0, parameters = { natural = 5 } } # f\n",
    "dotted": '[films]\nf.law = "constant_film"\nf.surfaces = ["block", "base"]\nf.environment = "air"\n'
    "f.emissivity = 0.0 # last\n\nf.parameters.natural = 5\n",
    "root": "",
}
ROOT = (
    "films.f.law = 'constant_film'\nfilms . f . surfaces = ['block', 'base']\n\"films\".'f'.environment = 'air'\n"
    "films.f.parameters = {natural = 5}\nfilms.f.emissivity = 0.0\n"
)
JOINT = '[contacts.c]\nkind = "fixed"\nsurfaces = ["block", "base"]\ntotal = "3 W/K"'


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_keys_are_inserted_however_the_table_is_written(way, newline):
    text = ((ROOT if way == "root" else "") + HEAD + WAYS[way] + JOINT).replace("\n", newline)
    values = {
        "films.f.gain": 0.75, "environment.air.offset": 0.4, "contacts.c.total": 3.3, "nodes.block.capacity": 1100.0,
        "nodes.base.capacity": 1600.0, "materials.steel.heat_capacity": 510.0,
    }  # fmt: skip
    if "steel" in text:
        del values["materials.steel.heat_capacity"]  # nothing is made of it
    remark = "calibrated: x"
    new = edited(text, values, dict.fromkeys(values, remark))
    data = tomllib.loads(new)
    assert data["films"]["f"]["gain"] == 0.75
    assert data["environment"]["air"]["offset"] == 0.4
    assert data["contacts"]["c"]["total"] == "3.3 W/K"
    assert data["nodes"]["base"]["capacity"] == "1.6kJ/K"
    assert data["nodes"]["block"]["capacity"] == 1100.0
    assert new.count(newline) == text.count(newline) + new.count("gain =") + new.count("offset =") - (way == "inline")
    assert new.count("\n") == new.count(newline)
    assert new.count(remark) == len(values)
    assert "block.capacity = 1100.0 # dotted; calibrated: x" in new
    for comment in re.findall(r"#[^\r\n]*", text):
        assert comment in new
    back = edited(new, {path: at(Machine.model_validate(tomllib.loads(text)), path) for path in values})
    assert Machine.model_validate(tomllib.loads(back)) == Machine.model_validate(tomllib.loads(text))


def test_joint_gain_goes_into_the_joint(tmp_path):
    slide = TEXTS["slide"].replace(
        'surfaces = ["block.x_max", "screw.x_min"]\nconductance = "3000 W/(m^2*K)"',
        'surfaces = ["block.x_max", "screw.x_min"]\njoint = { law = "bolted_joint" } # bolts',
    )
    new = edited(slide, {"contacts.screw_end.joint.gain": 1.25}, {"contacts.screw_end.joint.gain": "calibrated: it"})
    assert 'joint = { law = "bolted_joint", gain = 1.25 } # bolts; calibrated: it\n' in new


@pytest.mark.parametrize(
    ("path", "value", "says", "remedy"),
    [
        ("sources.motr.gain", 1.0, "no parameter", "'sources.motor.gain'"),
        ("materials.steel.conductivity", 40.0, "no parameter", "heat_capacity"),
        ("tcp.expansion.shaft", 1e-6, "no parameter", "tcp.expansion.shaft."),
        ("sources.motor.gain", float("nan"), "no value", "finite"),
        ("sources.motor.gain", -1.0, "greater than or equal to 0", "allows"),
        ("nodes.bed.capacity", 0.0, "greater than 0", "allows"),
    ],
)
def test_what_cannot_be_set_is_told(path, value, says, remedy):
    with pytest.raises(DescriptionError) as caught:
        edited(TEXTS["spindle"], {path: value})
    (problem,) = caught.value.problems
    assert says in problem.what
    assert remedy in problem.remedy


@pytest.mark.parametrize("text", ["", "a = ", "[machine]\nname = 3", "a = " + "[" * 3000])
def test_text_that_is_no_description_is_told(text):
    with pytest.raises(DescriptionError, match=r"problem|no machine description"):
        edited(text, {"sources.a.gain": 1.0})


def read(text: str, keys, data):
    """The value of a span as TOML reads it, and as it is in the data."""
    for key in keys:
        data = data[int(key)] if isinstance(data, list) else data[key]
    return tomllib.loads(f"v = {text}")["v"], data


def leaves(value):
    """All values that hold no others."""
    if isinstance(value, dict | list):
        for inner in value.values() if isinstance(value, dict) else value:
            yield from leaves(inner)
    else:
        yield value


@pytest.mark.parametrize("name", sorted(TEXTS))
def test_spans_of_machines_hold_their_values(name):
    text, data = TEXTS[name], tomllib.loads(TEXTS[name])
    found = spans(text)
    for keys, span in found.values.items():
        ours, theirs = read(text[span.start : span.end], keys, data)
        assert ours == theirs
    assert len([span for span in found.values.values() if text[span.start] not in "[{"]) == len(list(leaves(data)))


SCALARS = (
    st.none() | st.booleans() | st.integers(-(10**9), 10**9) | st.floats(allow_nan=False) | st.text() | st.datetimes()
)
VALUES = st.recursive(
    SCALARS.filter(lambda v: v is not None),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(min_size=1), inner, max_size=3),
    max_leaves=8,
)
PLAIN = st.from_regex(r"[A-Za-z0-9_-]{1,5}", fullmatch=True)


def without_quotes(value):
    """Keys of the alphabet that names in descriptions have."""
    if isinstance(value, dict):
        return {f"k{i}": without_quotes(v) for i, v in enumerate(value.values())}
    return [without_quotes(v) for v in value] if isinstance(value, list) else value


@settings(max_examples=150, deadline=None)
@given(st.dictionaries(PLAIN, VALUES.map(without_quotes), max_size=5))
def test_spans_of_any_toml_hold_its_values(data):
    """Written by another library."""
    text = tomlkit.dumps(data)
    read_back = tomllib.loads(text)
    found = spans(text)
    for keys, span in found.values.items():
        ours, theirs = read(text[span.start : span.end], keys, read_back)
        assert ours == theirs
    assert len([span for span in found.values.values() if text[span.start] not in "[{"]) == len(list(leaves(read_back)))
