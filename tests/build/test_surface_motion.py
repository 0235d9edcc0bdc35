"""What an artefact says of how its surface moves is what the full model's displacements of all nodes are there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.support.descriptions import SLIDE
from twin.build.displacement_field import DisplacementField
from twin.build.full_model import assemble
from twin.build.structure import Structure
from twin.build.surface_motion import surface_motion
from twin.calibrate.fit.product import write_calibrated
from twin.machine.load import load_machine
from twin.rom.artefact import read_artefact
from twin.rom.field_file import SurfaceField
from twin.rom.surface_motion import is_known, surface_displacements

pytestmark = pytest.mark.long


def test_heat_forces_and_rigid_motion_make_the_displacements_of_all_nodes():
    """Any temperatures of the nodes as the one direction of a basis: nothing is lost but rounding."""
    machine = load_machine(SLIDE)
    full = assemble(machine)
    assert isinstance(full.structure, Structure)
    rng = np.random.default_rng(1)
    fields = [20.0 * rng.standard_normal(b.n) for b in full.thermal.bodies]
    motion = surface_motion(machine, full, [T[:, None] for T in fields])
    for position in (-0.2, 0.013, 0.2):
        at = np.array([position])
        exact = DisplacementField(machine, full.bodies, full.structure)(at, fields)
        heat = np.concatenate([b.H @ T for b, T in zip(full.structure.bodies, fields, strict=True)])
        p, a, w = full.structure.motion(at, heat)
        forces = np.split(p, full.structure.system.offsets[1:-1])
        assert full.structure.port_displacements(at, heat) == pytest.approx(w, rel=1e-12)
        for b, ((by_heat, by_forces), surface) in enumerate(zip(motion, full.surfaces, strict=True)):
            wanted = full.thermal.bodies[b].F @ exact[b]
            moved = (by_heat[:, 0] + by_forces @ forces[b]).reshape(-1, 3)
            moved += a[b, :3] + np.cross(a[b, 3:], surface.points)
            assert np.abs(moved - wanted).max() < 1e-9 * np.abs(wanted).max()


def test_an_artefact_holds_them_and_one_without_says_so(slide_artefact):
    artefact = read_artefact(slide_artefact)
    assert is_known(artefact.model, artefact.fields)
    state = np.concatenate([b.one for b in artefact.model.bodies])  # 1 K everywhere
    moved = surface_displacements(artefact.model, artefact.fields, state, {"x": 0.1})
    for field, u in zip(artefact.fields, moved, strict=True):
        span = np.ptp(field.nodes, axis=0).max()
        assert 0.9e-5 * span < np.ptp(u, axis=0).max() < 1.4e-5 * span  # 9 to 12 um/(m K), and bending of iron by steel
    bare = tuple(SurfaceField(f.body, f.nodes, f.triangles, f.basis) for f in artefact.fields)
    assert not is_known(artefact.model, bare)
    with pytest.raises(ValueError, match="no displacements"):
        surface_displacements(artefact.model, bare, state, {"x": 0.1})


def test_calibrated_expansions_leave_no_displacement_that_is_no_longer_right(slide_artefact, tmp_path):
    artefact = replace(read_artefact(slide_artefact), description="")
    report = {"runs": [], "stopped": "converged", "iterations": 1}
    for kind, known in (("expansion", False), ("source", True)):
        one = next(p for p in artefact.parameters if p.kind == kind)
        row = {"path": one.path, "value": 1.1 * one.nominal}
        write_calibrated(artefact, tmp_path / "c.h5", {**report, "parameters": [row]}, artefact.parameters, "none")
        made = read_artefact(tmp_path / "c.h5")
        assert is_known(made.model, made.fields) is known
