"""The catalogue: complete, explained, documented, and open to entries of one's own."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from tests.diagnose import small_case
from twin.cli.main import run
from twin.diagnose.evidence.batch import best, prepared
from twin.diagnose.evidence.whiten import Projector
from twin.diagnose.faults.catalogue import FAMILIES, explained, family, with_own
from twin.diagnose.faults.context import Context
from twin.diagnose.report.catalogue import BEGIN, END, catalogue_table, renewed
from twin.diagnose.result.diagnosis import Cause, Window
from twin.errors import TwinError
from twin.machine.effects.edits import EDITS, extended_description

PAGE = Path(__file__).parents[2] / "docs" / "diagnosis.md"


@pytest.fixture(scope="module")
def lamp(tmp_path_factory):
    """The file of the example in docs/diagnosis.md."""
    code = PAGE.read_text("utf-8").split("```python\n")[1].split("```")[0]
    path = tmp_path_factory.mktemp("own") / "lamp.py"
    path.write_text(code, encoding="utf-8")
    return path


def test_every_entry_once():
    assert [f.number for f in FAMILIES] == list(range(1, 22))
    assert len({f.name for f in FAMILIES}) == 21
    assert {f.name for f in FAMILIES} == set(EDITS) | {"missing_member"}  # whose nodes are no edit of this kind
    assert {f.group for f in FAMILIES} == {"machine", "sensor", "signal", "reading"}
    for f in FAMILIES:
        assert all((f.title, f.physics, f.operator, f.signature, f.smallest, f.sign, f.searched)), f.name


def test_the_page_shows_the_catalogue():
    page = PAGE.read_text("utf-8")
    assert renewed(page) == page, "run: python -m twin.diagnose.report.catalogue docs/diagnosis.md"
    rows = page.split(BEGIN)[1].split(END)[0].strip().splitlines()
    assert len(rows) == 2 + len(FAMILIES)
    assert all(row.replace("\\|", "").count("|") == 9 for row in rows)
    assert catalogue_table(FAMILIES[:1]) == "\n".join(rows[:3]) + "\n"
    with pytest.raises(ValueError, match="no marks"):
        renewed("# Diagnosis")


def test_explain_prints_an_entry(capsys):
    assert run(["diagnose", "--explain", "heat_source"]) == 0
    told = capsys.readouterr().out
    assert told.strip() == explained(family("heat_source")).strip()
    assert told.startswith("3. Heat source missing (heat_source)")
    assert "b_place s(t)" in told


def test_explain_prints_all_of_them(capsys):
    assert run(["diagnose", "--explain", "all"]) == 0
    told = capsys.readouterr().out
    assert all(f"{f.number}. {f.title} ({f.name})" in told for f in FAMILIES)


def test_an_unknown_name_gets_the_nearest(capsys):
    assert run(["diagnose", "--explain", "heat_sorce"]) == 2
    assert "heat_source" in capsys.readouterr().err


def test_the_example_is_an_entry(lamp, capsys):
    families = with_own(lamp)
    assert [f.name for f in families] == ["lamp", *(f.name for f in FAMILIES)]
    assert run(["diagnose", "--catalogue", str(lamp), "--explain", "lamp"]) == 0
    assert "Lamp over the machine" in capsys.readouterr().out


@pytest.mark.long
def test_the_example_finds_its_lamp(lamp):
    """Hidden in first-order responses, looked for among all hypotheses of heat, with free parameters."""
    study, elements, D = small_case.study(), small_case.elements(), small_case.responses()
    context = Context(study, elements, elements.index)
    sigma, x = [], np.zeros(len(study.probed.parameters))
    for k in study.fitted:
        (b, s), (rows, _) = study.runs[k].shapes
        sigma += [np.full(b * s, 0.02), np.full(rows * 3, 3e-7)]
    weight = 1.0 / np.concatenate(sigma)[:, None]
    J = np.vstack([study.jacobian(k, x)[:, : len(x)] for k in study.fitted])
    white, projector = D * weight, Projector.of(J * weight)
    (own,) = family("lamp", with_own(lamp)).batches(context)
    hidden = own.columns[own.places.index("housing")], own.histories[1].weights[0]
    assert hidden[1].sum() == 4.0  # two hours in each of two runs
    r = np.random.default_rng(0).standard_normal(len(D)) + 30.0 * white[:, hidden[0]] @ hidden[1]
    ready = [
        prepared(b, np.stack([white[:, c].T @ projector(white[:, c]) for c in b.columns]))
        for b in [own, *family("heat_source").batches(context)]
    ]
    first = best(ready, white.T @ projector(r))[0]
    assert (first.family, first.name) == ("lamp", "housing")
    assert first.when.name == "for 2 h after every start"
    assert first.amplitude[0] == pytest.approx(30.0, abs=5.0)


@pytest.mark.long
def test_the_example_is_written_into_a_description(lamp):
    """As what its `edit` says: a heat source that a switch turns on for the hours that it was found in."""
    entry = family("lamp", with_own(lamp))
    windows = (Window("day", 0.0, 7200.0),)
    cause = Cause(
        "lamp", "housing", "", 30.0, (25.0, 35.0), "W", 90.0, 36.0, "for 2 h after every start", windows=windows
    )
    assert entry.changes(cause)
    text = (small_case.machine().folder / "machine.toml").read_text("utf-8")
    edit = extended_description(text, [entry.edit(cause, small_case.study())])
    added = {k: v for k, v in tomllib.loads(edit.text)["sources"].items() if k not in tomllib.loads(text)["sources"]}
    assert [source["surface"] for source in added.values()] == ["housing"]
    assert set(edit.signals.values()) == {windows}


def test_an_entry_of_a_known_name_takes_its_place(lamp, tmp_path):
    own = tmp_path / "own.py"
    own.write_text(lamp.read_text("utf-8").replace('name="lamp"', 'name="heat_source"'), encoding="utf-8")
    families = with_own(own)
    assert len(families) == 21
    assert family("heat_source", families).title == "Lamp over the machine"


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (None, "cannot be read"),
        ("FAMILIES = (", "does not run: SyntaxError"),
        ("import nothing_of_the_kind", "does not run: ModuleNotFoundError"),
        ("1 / 0", "does not run: ZeroDivisionError"),
        ("", "defines no tuple FAMILIES"),
        ("FAMILIES = [1, 2]", "defines no tuple FAMILIES"),
        ("FAMILIES = ('heat',)", "defines no tuple FAMILIES"),
    ],
)
def test_files_that_are_no_catalogue(tmp_path, text, wanted, capsys):
    path = tmp_path / "own.py"
    if text is not None:
        path.write_text(text, encoding="utf-8")
    with pytest.raises(TwinError, match=wanted):
        with_own(path)
    assert run(["diagnose", "--catalogue", str(path), "--explain", "all"]) == 2
    told = capsys.readouterr().err
    assert wanted in told
    assert "Traceback" not in told
