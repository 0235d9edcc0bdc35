"""`twin check` finds bodies that can move freely, as the build would refuse them, without factoring anything."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from tests.support.descriptions import SLIDE, edited
from twin.build.check_meshes import check_meshes
from twin.build.mechanism import mechanisms
from twin.build.mesh import load_body_meshes
from twin.build.structure import assemble_structure
from twin.errors import ModelError
from twin.machine.description import StiffnessOfPair
from twin.machine.load import load_machine

ONE_RAIL = '  ["rail_2.z_max", "pad_3.z_min"],\n  ["rail_2.z_max", "pad_4.z_min"],\n'


def test_a_slide_on_one_rail_can_roll(tmp_path: Path):
    """Two pads on one rail and a nut: every direction is held, and so are pitch and yaw; no single key is missing."""
    machine = load_machine(edited(tmp_path, (ONE_RAIL, "")))
    (problem,) = check_meshes(machine).problems
    with pytest.raises(ModelError) as refused:
        assemble_structure(machine, load_body_meshes(machine))
    (as_built,) = refused.value.problems
    assert as_built.what in problem.what
    assert as_built.where in problem.what
    assert as_built.remedy in problem.remedy
    assert "body 'slide' turns freely about x" in problem.what
    assert problem.where == "machine.toml: contacts.x_screw.stiffness"
    assert "contacts.x_guide.stiffness" in problem.remedy
    assert not problem.warning


def test_a_bed_on_supports_in_a_row_can_tip(tmp_path: Path):
    """Two feet in a row along x, without the third; the supports are what to change."""
    third = '[supports.foot_3]\nsurface = "foot_3.z_min"\nstiffness = ["50 N/um", "50 N/um", "200 N/um"]\n'
    feet = ('surface = "foot_2.z_min"', 'surface = "foot_3.z_min"')
    machine = load_machine(edited(tmp_path, (third, ""), feet))
    problems = check_meshes(machine).problems
    assert [p.where for p in problems] == ["machine.toml: supports.foot_1.stiffness"]
    assert "turns freely about" in problems[0].what
    assert "bed" in problems[0].what
    assert "slide" in problems[0].what


def test_what_yields_but_holds_is_no_mechanism():
    """Springs of very different stiffness: 1 N/mm beside 200 N/um."""
    machine = load_machine(SLIDE)
    screw = machine.contacts["x_screw"].model_copy(update={"stiffness": StiffnessOfPair(axial=1e3)})
    soft = machine.model_copy(update={"contacts": machine.contacts | {"x_screw": screw}})
    assert list(mechanisms(soft, load_body_meshes(soft))) == []


def test_it_takes_a_fraction_of_the_build():
    machine = load_machine(SLIDE)
    bodies = load_body_meshes(machine)
    start = time.process_time()
    assert list(mechanisms(machine, bodies)) == []
    checked = time.process_time() - start
    start = time.process_time()
    assemble_structure(machine, bodies)
    assert checked < 0.5 * (time.process_time() - start)
