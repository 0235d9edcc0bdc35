"""Descriptions without a TCP, supports, expansion or elastic constants; and what a TCP asks for."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path

import pytest

from tests.support.descriptions import MACHINES, SLIDE
from tests.support.lumped import HEAD, film, source
from twin.errors import DescriptionError
from twin.machine.check import check_machine
from twin.machine.load import load_machine
from twin.machine.parameters import parameters

PLATE = next(path for path in MACHINES if path.parent.name == "plate")
TCP = r"\[tcp\.tool\][^\[]*\[[^\]]*\]\s*\[tcp\.work\][^\[]*"
WITHOUT = {
    "supports": r"\[supports\.[^\]]*\]\s*surface[^\n]*\nstiffness[^\n]*\n",
    "expansion": r"expansion = [^\n]*\n",
    "youngs_modulus": r"youngs_modulus = [^\n]*\n",
    "poisson_ratio": r"poisson_ratio = [^\n]*\n",
}


def slide(folder: Path, *missing: str, tcp: bool) -> Path:
    """The slide's description without some keys or sections."""
    text = SLIDE.read_text(encoding="utf-8")
    for pattern in (*(WITHOUT[key] for key in missing), *(() if tcp else (TCP,))):
        text, count = re.subn(pattern, "", text)
        assert count > 0
    (folder / "machine.toml").write_text(text, encoding="utf-8")
    return folder / "machine.toml"


@pytest.mark.parametrize("missing", [m for k in range(len(WITHOUT) + 1) for m in combinations(WITHOUT, k)])
def test_any_of_it_may_be_missing_without_a_tcp(tmp_path: Path, missing: tuple[str, ...]):
    machine = load_machine(slide(tmp_path, *missing, tcp=False))
    assert not machine.has_tcp
    assert not [p for p in check_machine(machine) if not p.warning]
    assert not [p.path for p in parameters(machine) if p.kind == "expansion"]
    assert "materials.steel.heat_capacity" in {p.path for p in parameters(machine)}


@pytest.mark.parametrize("key", list(WITHOUT))
def test_a_tcp_asks_for_each_and_names_file_key_line_and_part(tmp_path: Path, key: str):
    path = slide(tmp_path, key, tcp=True)
    with pytest.raises(DescriptionError) as refused:
        load_machine(path)
    problems = refused.value.problems
    assert {p.what for p in problems} == {f"missing key '{key}'"}
    if key == "supports":
        assert [p.where for p in problems] == [f"{path}: supports"]
        return
    line = path.read_text(encoding="utf-8").split("\n").index("[materials.aluminium]") + 1
    told = {p.where: p.remedy for p in problems}
    assert len(told) == 3
    assert told[f"{path}: materials.aluminium.{key} (line {line})"].startswith("parts.plate is made of it")
    assert f"write {key} = " in next(iter(told.values()))
    assert any("parts.bed and 2 more are made of it" in remedy for remedy in told.values())


def test_supports_that_nothing_reads_are_told(tmp_path: Path):
    (warning,) = check_machine(load_machine(slide(tmp_path, tcp=False)))
    assert warning.warning
    assert warning.what.startswith("without a TCP nothing reads supports.foot_1")
    assert check_machine(load_machine(PLATE)) == []


def test_a_scale_without_a_tcp_is_refused(tmp_path: Path):
    path = slide(tmp_path, tcp=False)
    scale = '\n[scales.x]\naxis = "x"\nsurface = "bed.y_max"\nexpansion = "1e-6 1/K"\n'
    path.write_text(path.read_text(encoding="utf-8") + scale, encoding="utf-8")
    with pytest.raises(DescriptionError, match="a scale moves the TCP, and there is none"):
        load_machine(path)


def test_a_gap_belongs_to_fixed_contacts_of_parts(tmp_path: Path):
    path = tmp_path / "machine.toml"
    text = SLIDE.read_text(encoding="utf-8").replace("segments = 8\n", 'segments = 8\ngap = "1 mm"\n')
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DescriptionError, match="'gap' in a moving contact"):
        load_machine(path)
    nodes = "[nodes.a]\ncapacity = 1e3\narea = 0.1\n[nodes.b]\ncapacity = 1e3\narea = 0.1\n"
    contact = '[contacts.ab]\nkind = "fixed"\nsurfaces = ["a", "b"]\ntotal = 12\ngap = "1 mm"\n'
    path.write_text(HEAD + nodes + contact + film("air", "a b", 8.0) + source("q", "a"), encoding="utf-8")
    with pytest.raises(DescriptionError, match="'gap' in a contact of a lumped machine"):
        load_machine(path)


def test_a_screw_of_a_lumped_machine_needs_an_expansion(tmp_path: Path):
    spindle = next(path for path in MACHINES if path.parent.name == "spindle").read_text(encoding="utf-8")
    (tmp_path / "machine.toml").write_text(re.sub(r"(?m)^expansion = [^\n]*1/K\"\n", "", spindle), encoding="utf-8")
    with pytest.raises(DescriptionError, match="missing key 'expansion'"):
        load_machine(tmp_path)
