"""Additions to a description: all that was there stays, byte by byte, and comes back without them."""

from __future__ import annotations

import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.descriptions import MACHINES, SLIDE
from twin.errors import DescriptionError
from twin.machine.extend import appended, changed, free_name, removed
from twin.machine.instances import written_out
from twin.machine.load import load_machine
from twin.machine.parameters import parameter_units

TEXTS = {path.parent.name: written_out(path.read_bytes().decode("utf-8")) for path in MACHINES}
UNITS = {path.parent.name: parameter_units(load_machine(path)) for path in MACHINES}
TEXT = TEXTS["slide"]
SOURCE = ("sources.found_1", {"law": "constant_heat", "surface": "bed.x_max", "parameters": {"power": "10 W"}})


def test_new_tables_stand_in_a_marked_block_at_the_end():
    text = appended(TEXT, [SOURCE], "heat_source at bed.x_max: 10 W")
    assert text.startswith(TEXT)
    assert text[len(TEXT) :].splitlines() == [
        "",
        "# --- found by twin diagnose ---",
        "# heat_source at bed.x_max: 10 W",
        "[sources.found_1]",
        'law = "constant_heat"',
        'surface = "bed.x_max"',
        'parameters = { power = "10 W" }',
        "",
        "# --- end of found by twin diagnose ---",
    ]
    assert load_machine(SLIDE, text).sources["found_1"].parameters == {"power": "10 W"}


def test_a_second_call_continues_the_block():
    once = appended(TEXT, [SOURCE], "one")
    text = appended(once, [("signals.found_2", {"unit": "1", "range": [0.0, 1.0]})], "two\nlines")
    assert text.count("# --- found by twin diagnose ---") == 1
    assert "# two lines\n[signals.found_2]\n" in text
    assert removed(text) == TEXT


def test_hidden_and_found_have_blocks_of_their_own():
    text = appended(TEXT, [SOURCE], "one", "hidden")
    text = appended(text, [("signals.found_2", {"unit": "1", "range": [0.0, 1.0]})], "two")
    assert text.count("\n# --- hidden by twin hide ---\n") == text.count("\n# --- found by twin diagnose ---\n") == 1
    assert removed(text) == TEXT


def test_text_after_a_block_stays():
    by_hand = '\n[signals.door]\nunit = "1"\nrange = [0.0, 1.0]\n'
    assert removed(appended(TEXT, [SOURCE], "one") + by_hand) == TEXT + by_hand
    bare = TEXT.rstrip("\n")
    assert removed(appended(bare, [SOURCE], "one") + by_hand) == bare + "\n" + by_hand


def test_a_name_that_is_taken_is_refused():
    text = appended(TEXT, [SOURCE], "one")
    with pytest.raises(DescriptionError, match="there already"):
        appended(text, [SOURCE], "again")
    assert free_name(text, "found") == "found_2"
    assert free_name(TEXT, "found") == "found_1"


def test_a_section_as_inline_table_is_refused():
    with pytest.raises(DescriptionError, match="cannot extend"):
        appended('sources = { a = { law = "constant_heat" } }\n', [SOURCE], "one")


@pytest.mark.parametrize(
    ("line", "path", "value", "after"),
    [
        ('conductance = "1500 W/(m^2*K)"', "contacts.x_guide.conductance", 3000.0,
         'conductance = "3000 W/(m^2*K)"  # found: was "1500 W/(m^2*K)"'),
        ('surface = "block.x_min"', "sources.x_motor.surface", "bed.x_max",
         'surface = "bed.x_max"  # found: was "block.x_min"'),
        ('position = "x_position"', "contacts.x_guide.switch", "door", None),
    ],
)  # fmt: skip
def test_a_changed_line_keeps_its_old_value(line, path, value, after):
    text = changed(TEXT, {path: value})
    before = TEXT.splitlines()
    if after is None:
        (new,) = [new for new in text.splitlines() if new not in before]
        assert new == 'switch = "door"  # found: new'
    else:
        assert [new for new in text.splitlines() if new not in before] == [after]
        assert len(text.splitlines()) == len(before)
    assert removed(text) == TEXT


def test_a_comment_stays_before_the_old_value():
    old = 'adiabatic = ["z_min"] # on the floor'
    assert TEXT.count(old) == 1
    text = changed(TEXT.replace('material = "steel"\n' + old, 'material = "steel"   #  of  old\n' + old),
                   {"parts.foot_1.material": "cast_iron"})  # fmt: skip
    assert 'material = "cast_iron"   #  of  old  # found: was "steel"\n' in text


def test_a_value_that_changes_twice_remembers_the_first():
    text = changed(changed(TEXT, {"films.floor.gain": 2.0}), {"films.floor.gain": 3.0}, "hidden")
    assert "gain = 3.0  # found: new\n" in text
    assert removed(text) == TEXT
    text = changed(changed(TEXT, {"contacts.nut.conductance": 1e3}, "hidden"), {"contacts.nut.conductance": 2e3})
    assert 'conductance = "2000 W/(m^2*K)"  # hidden: was "5000 W/(m^2*K)"\n' in text
    assert removed(text) == TEXT


def test_entries_written_as_inline_tables_change_as_a_whole():
    head = 'machine = { name = "m" }\nenvironment = {}\nfilms = {}\n[signals]\n'
    text = head + 'a = { unit = "A", range = [0.0, 1.0] } # amps\n'
    new = changed(text, {"signals.a.factor": 2.0, "signals.a.kind": "peak"})
    assert tomllib.loads(new)["signals"]["a"] == {"unit": "A", "range": [0.0, 1.0], "factor": 2.0, "kind": "peak"}
    assert removed(new) == text


def test_paths_without_an_owner_are_refused():
    with pytest.raises(DescriptionError, match="no such table"):
        changed(TEXT, {"signals.nothing.factor": 2.0})


@st.composite
def additions(draw):
    """The name of a shipped machine, values of its parameters and tables to put in."""
    name = draw(st.sampled_from(sorted(TEXTS)))
    # growth of a node is one number of an array, perhaps on several lines
    paths = [path for path in sorted(UNITS[name]) if not path.startswith("tcp.")]
    values = {
        path: draw(st.floats(0.5, 2.0)) for path in draw(st.lists(st.sampled_from(paths), max_size=4, unique=True))
    }
    value = st.one_of(
        st.floats(allow_nan=False, allow_infinity=False),
        st.booleans(),
        st.text("a\u00e4 \\\"'\t#[]\n", max_size=8),
        st.lists(st.integers(-5, 5), max_size=3),
    )
    tables = draw(st.lists(st.dictionaries(st.sampled_from(["a", "b c", "d"]), value, max_size=3), max_size=3))
    return name, values, [(f"signals.found_{i}", table) for i, table in enumerate(tables)]


@settings(max_examples=25, deadline=None)
@given(additions(), st.booleans(), st.booleans(), st.booleans())
def test_whatever_is_put_in_comes_out_again(addition, windows, cut, twice):
    name, values, tables = addition
    text = TEXTS[name].rstrip("\n") if cut else TEXTS[name]
    text = text.replace("\n", "\r\n") if windows else text
    new = changed(text, values)
    if twice:
        new = changed(new, dict.fromkeys(values, 1.25), "hidden")
    if tables:
        new = appended(new, tables, "why")
    after = tomllib.loads(new)
    for table_name, table in tables:
        assert after["signals"].pop(table_name.partition(".")[2]) == table
    assert ("\n" in new.replace("\r\n", "")) != windows
    if not values:  # the plate has no signals of its own
        assert after == {"signals": {}} | tomllib.loads(text) if tables else after == tomllib.loads(text)
    assert removed(new) == text
    assert removed(text) == text
