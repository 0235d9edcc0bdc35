"""Implausible materials: a factor 1000 is found and named, the unusual only warned of."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.descriptions import SLIDE, edited
from twin.machine.check import check_machine
from twin.machine.load import load_machine


def test_the_slide_has_nothing_odd():
    assert check_machine(load_machine(SLIDE)) == []


@pytest.mark.parametrize(
    ("old", "new", "place", "right"),
    [
        (
            'conductivity = "45 W/(m*K)"',
            'conductivity = "45 W/(mm*K)"',
            "materials.steel.conductivity",
            "45 W/(m*K) would fit",
        ),
        ('conductivity = "45 W/(m*K)"', "conductivity = 0.045", "materials.steel.conductivity", "45 W/(m*K) would fit"),
        ('density = "7850 kg/m^3"', "density = 7.85", "materials.steel.density", "7850 kg/m^3 would fit"),
        ('youngs_modulus = "210 GPa"', "youngs_modulus = 210e3", "materials.steel.youngs_modulus", "would fit"),
        ('expansion = "11.5e-6 1/K"', "expansion = 11.5", "materials.steel.expansion", "1.15e-05 1/K would fit"),
    ],
)
def test_a_factor_of_a_unit_is_an_error_that_names_it(tmp_path: Path, old, new, place, right):
    problems = [p for p in check_machine(load_machine(edited(tmp_path, (old, new)))) if not p.warning]
    assert len(problems) == 1
    assert place in problems[0].where
    assert right in problems[0].remedy


def test_unused_entries_are_warned_of(tmp_path: Path):
    path = edited(tmp_path, ("[environment.shop]", '[signals.spare]\nunit = "A"\nrange = [0, 1]\n\n[environment.shop]'))
    (problem,) = check_machine(load_machine(path))
    assert problem.warning
    assert "signals.spare" in problem.where


def test_a_joint_law_outside_its_validity_is_warned_of(tmp_path: Path):
    joint = (
        'surfaces = ["bed.z_min", "foot_1.z_max"]\n[contacts.foot_1.joint]\nlaw = "bolted_joint"\n'
        "[contacts.foot_1.joint.parameters]\n"
        'conductivity_1 = "50 W/(m*K)"\nconductivity_2 = "45 W/(m*K)"\nroughness_1 = "1.6 um"\n'
        'roughness_2 = "1.6 um"\nslope_1 = 0.15\nslope_2 = 0.15\nhardness = "2.6 GPa"\npressure = "5 MPa"'
    )
    old = 'surfaces = ["bed.z_min", "foot_1.z_max"]\nconductance = "2000 W/(m^2*K)"'
    assert check_machine(load_machine(edited(tmp_path, (old, joint)))) == []
    (problem,) = check_machine(load_machine(edited(tmp_path, (old, joint.replace("5 MPa", "500 MPa")))))
    assert problem.warning
    assert "contacts.foot_1" in problem.where
    assert "p/H" in problem.what
