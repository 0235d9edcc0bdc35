"""The finer mesh is one of the same solid: volume, surfaces, their areas, curvature, and elements as well shaped."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from skfem import MeshTet1, MeshTet2

from tests.build.parts import box
from tests.build.test_mesh_file import cylinder, read
from twin.build.mesh import PartMesh, load_body_meshes
from twin.build.refine import refined, refined_size
from twin.build.surface import patch
from twin.machine.load import load_machine

SLIDE = Path(__file__).parents[1] / "machines" / "slide"
ROUND = 2.0 * (np.pi / 4) * (1.0 - 0.25)  # m^3 of the quarter of a pipe in `cylinder`


def volume(part: PartMesh) -> float:
    return float(sum(chunk.dx.sum() for chunk in part.chunks()))


@pytest.mark.parametrize("quadratic", [False, True])
def test_a_refined_cylinder_is_the_same_solid_with_the_same_surfaces(tmp_path: Path, quadratic: bool):
    part = read(cylinder(quadratic=quadratic), tmp_path / "c.msh", "gmsh22")
    fine = refined(part)
    assert type(fine.mesh) is type(part.mesh) is (MeshTet2 if quadratic else MeshTet1)
    assert fine.mesh.nelements == 8 * part.mesh.nelements
    assert fine.n == refined_size(part)
    np.testing.assert_array_equal(fine.nodes[: part.n], part.nodes)
    assert volume(fine) == pytest.approx(volume(part), rel=1e-12)
    assert list(fine.surfaces) == list(part.surfaces)
    for name in part.surfaces:
        old, new = patch(part, part.facets(name)), patch(fine, fine.facets(name))
        assert len(fine.facets(name)) == 4 * len(part.facets(name))
        assert new.area == pytest.approx(old.area, rel=1e-6 if quadratic else 1e-12)  # quadrature of curved facets
        np.testing.assert_allclose(new.centroid, old.centroid, atol=1e-6 if quadratic else 1e-12)


def test_curved_faces_stay_on_the_quadratic_surface_instead_of_its_chords(tmp_path: Path):
    part = read(cylinder(), tmp_path / "c.msh", "gmsh22")
    fine = refined(part)
    radius = np.linalg.norm(fine.nodes[:, :2], axis=1)
    outer = radius > 0.97
    assert (np.abs(radius[outer] - 1.0) < 2e-4).all()  # 15 degrees at a time: the old curve's own deviation
    assert outer.sum() > 3 * (np.linalg.norm(part.nodes[:, :2], axis=1) > 0.97).sum()
    assert fine.mesh.nvertices == part.n
    assert volume(fine) == pytest.approx(ROUND, rel=1e-4)
    chords = read(cylinder(quadratic=False), tmp_path / "s.msh", "gmsh22")
    assert volume(refined(chords)) == pytest.approx(volume(chords), rel=1e-12)
    assert abs(volume(chords) / ROUND - 1.0) > 5e-3


def test_elements_of_a_twice_refined_box_have_two_shapes_and_not_worse_and_worse_ones():
    part = box("a", (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (2, 2, 2))

    def worst(part: PartMesh) -> float:
        """Smallest volume of an element as a share of its longest edge cubed."""
        corners = part.mesh.p[:, part.mesh.t]  # (3, 4, m)
        volumes = np.abs(np.linalg.det((corners[:, 1:] - corners[:, :1]).transpose(2, 0, 1))) / 6
        pairs = corners[:, :, None] - corners[:, None, :]
        return float((volumes / np.linalg.norm(pairs, axis=0).max(axis=(0, 1)) ** 3).min())

    once, twice = refined(part), refined(refined(part))
    assert worst(once) == pytest.approx(worst(part), rel=1e-9)
    assert worst(twice) == pytest.approx(worst(part), rel=1e-9)


def test_every_part_of_a_machine_can_be_refined():
    for body in load_body_meshes(load_machine(SLIDE)):
        for part in body.parts:
            fine = refined(part)
            assert volume(fine) == pytest.approx(volume(part), rel=1e-12)
            assert fine.n == refined_size(part)
