"""Parts and bodies: unknowns, surfaces, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from skfem import MeshTet1, MeshTet2

from tests.build.parts import box, linear, stacked
from twin.build.mesh import load_body_meshes, load_part_mesh, part_mesh
from twin.errors import DescriptionError
from twin.machine.description import Box, Part
from twin.machine.load import load_machine

SLIDE = Path(__file__).parents[1] / "machines" / "slide"


def test_every_unknown_lies_where_its_shape_function_is_one():
    part = box("a", (0.1, 0.2, 0.3), (1.0, 0.5, 0.2), (3, 2, 1))
    basis = part.basis
    at_nodes = basis.mapping.F(basis.elem.doflocs.T)  # (3, elements, 10)
    np.testing.assert_allclose(at_nodes.transpose(1, 2, 0), part.nodes[part.elements], atol=1e-15)
    assert part.n == part.mesh.nvertices + part.mesh.nedges == len(np.unique(part.elements))


def test_box_surfaces_cover_the_outside_exactly_once():
    part = box("a", (0.0, 0.0, 0.0), (1.0, 2.0, 3.0), (2, 3, 4))
    together = np.concatenate(list(part.surfaces.values()))
    assert sorted(part.surfaces) == ["x_max", "x_min", "y_max", "y_min", "z_max", "z_min"]
    np.testing.assert_array_equal(np.sort(together), np.sort(part.mesh.boundary_facets()))
    top = part.mesh.p[2, part.mesh.facets[:, part.facets("z_max")]]
    assert (top == 3.0).all()


def test_chunks_together_hold_every_element_once():
    part = box("a", (0.0, 0.0, 0.0), (1.0, 2.0, 3.0), (2, 3, 4))
    volumes = [chunk.dx.sum() for chunk in part.chunks(size=37)]
    assert len(volumes) == -(-part.mesh.nelements // 37)
    assert sum(volumes) == pytest.approx(6.0, rel=1e-14)


def test_bodies_join_the_unknowns_of_their_parts():
    body = stacked((2, 3, 1), (3, 2, 1))
    b, offset = body.part("b")
    assert body.n == sum(p.n for p in body.parts)
    np.testing.assert_array_equal(body.nodes[offset:], b.nodes)
    np.testing.assert_array_equal(linear(body.nodes)[body.elements[-1]], linear(b.nodes)[b.elements[-1]])
    with pytest.raises(DescriptionError, match="no part of body 'a'"):
        body.part("c")


def test_the_bodies_of_a_machine():
    bodies = load_body_meshes(load_machine(SLIDE))
    assert [b.name for b in bodies] == ["bed", "slide"]
    assert [p.name for p in bodies[1].parts] == ["slide", "pad_1", "pad_2", "pad_3", "pad_4", "nut", "plate"]


def test_unknown_surface_lists_those_there_are():
    with pytest.raises(DescriptionError, match="unknown surface 'top'") as e:
        box("a", (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (1, 1, 1)).facets("top")
    assert "z_max" in e.value.problems[0].remedy


@pytest.mark.parametrize(
    ("part", "match"),
    [
        (Part(material="steel"), "either a mesh or a box"),
        (Part(material="steel", mesh="missing.msh"), "no mesh file"),
        (Part(material="steel", box=Box(origin=(0, 0, 0), size=(1, 0, 1), divisions=(1, 1, 1))), "size"),
        (Part(material="steel", box=Box(origin=(0, 0, 0), size=(1, 1, 1), divisions=(1, 0, 1))), "divisions"),
    ],
)
def test_parts_without_a_solid_are_refused(part: Part, match: str):
    with pytest.raises(DescriptionError, match=match) as e:
        load_part_mesh("bed", part, Path())
    assert "parts.bed" in e.value.problems[0].where
    assert e.value.problems[0].remedy


def test_all_faults_of_a_mesh_are_reported_at_once():
    mesh = MeshTet1.init_tensor(np.linspace(0, 1, 2), np.linspace(0, 1, 2), np.linspace(0, 1, 2))
    outer = mesh.boundary_facets()
    with pytest.raises(DescriptionError) as e:
        part_mesh("a", mesh, {"left": outer[:4], "right": outer[3:10], "none": outer[:0]})
    said = " | ".join(p.what for p in e.value.problems)
    assert "surface 'none' has no facets" in said
    assert f"{len(outer) - 10} of {len(outer)} outer facets belong to no named surface, centroid at (" in said
    assert "1 facets belong to more than one of the surfaces left, right" in said


def test_flat_tetrahedra_and_separate_pieces_are_refused():
    p = np.array([[0, 1, 0, 0, 5, 6, 5, 5.5], [0, 0, 1, 0, 0, 0, 1, 0.5], [0, 0, 0, 1, 0, 0, 0, 0]], dtype=float)
    mesh = MeshTet1(p, np.array([[0, 1, 2, 3], [4, 5, 6, 7]]).T)
    with pytest.raises(DescriptionError) as e:
        part_mesh("a", mesh, {"all": mesh.boundary_facets()})
    assert [p.what.split(",")[0] for p in e.value.problems] == [
        "1 flat tetrahedra",
        "the mesh falls into 2 pieces that share no nodes",
    ]


def test_curved_meshes_keep_their_nodes():
    mesh = MeshTet2.init_ball(nrefs=1)
    part = part_mesh("ball", mesh, {"all": mesh.boundary_facets()})
    radius = np.linalg.norm(part.nodes[np.unique(part.elements[:, 4:])], axis=1)
    assert part.n == mesh.doflocs.shape[1]
    assert (np.abs(radius - 1.0) < 1e-12).sum() > 10  # mid-edge nodes on the sphere, not on chords
