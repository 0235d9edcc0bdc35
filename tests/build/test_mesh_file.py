"""Mesh files: names of surfaces, orders of elements, units, and files that are not what they should be."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
from skfem import MeshTet1, MeshTet2

from twin.build.mesh import PartMesh, load_part_mesh
from twin.build.surface import patch
from twin.errors import DescriptionError
from twin.machine.description import Part

SIDES = ("bottom", "top", "mantle")


def cylinder(rings: int = 8, layers: int = 3, quadratic: bool = True) -> meshio.Mesh:
    """A quarter of a cylinder of radius 1 and height 2 with named surfaces; quadratic meshes follow the curve."""
    radius, angle, height = np.linspace(0.5, 1, 3), np.linspace(0, np.pi / 2, rings), np.linspace(0, 2, layers)
    straight = MeshTet1.init_tensor(radius, angle, height)
    mesh = MeshTet2.from_mesh(straight) if quadratic else straight
    cells = (mesh.dofs.element_dofs if quadratic else mesh.t).T
    points = (mesh.doflocs if quadratic else mesh.p).T
    r, phi, z = points.T
    bent = np.column_stack([r * np.cos(phi), r * np.sin(phi), z])

    outer = straight.boundary_facets()
    corners = straight.facets[:, outer]
    middle = straight.p[:, corners].mean(axis=1)
    which = np.full(len(outer), 4)
    which[middle[2] < 1e-9], which[middle[2] > 2 - 1e-9], which[middle[0] > 1 - 1e-9] = 1, 2, 3
    triangles = corners.T
    if quadratic:
        triangles = np.hstack(
            [triangles, np.stack([_middle(mesh, triangles[:, [i, (i + 1) % 3]]) for i in range(3)], 1)]
        )
    kind = ("tetra10", "triangle6") if quadratic else ("tetra", "triangle")
    return meshio.Mesh(
        bent,
        [(kind[0], cells), *((kind[1], triangles[which == k]) for k in (1, 2, 3, 4))],
        cell_data={
            "gmsh:physical": [np.full(len(cells), 9), *(np.full((which == k).sum(), k) for k in (1, 2, 3, 4))],
            "gmsh:geometrical": [np.full(len(cells), 1), *(np.full((which == k).sum(), k) for k in (1, 2, 3, 4))],
        },
        field_data={
            "bottom": np.array([1, 2]),
            "top": np.array([2, 2]),
            "mantle": np.array([3, 2]),
            "rest": np.array([4, 2]),
            "solid": np.array([9, 3]),
        },
    )


def _middle(mesh: MeshTet2, ends: np.ndarray) -> np.ndarray:
    """Mid-edge nodes of vertex pairs (m, 2)."""
    number = {tuple(sorted(pair)): i for i, pair in enumerate(mesh.edges.T.tolist())}
    return np.array([mesh.nvertices + number[tuple(sorted(pair))] for pair in ends.tolist()])


def read(mesh: meshio.Mesh, path: Path, file_format: str | None = None, unit: str = "m") -> PartMesh:
    meshio.write(path, mesh, file_format=file_format)
    return load_part_mesh("part", Part(material="steel", mesh=path.name, mesh_unit=unit), path.parent)


@pytest.mark.parametrize("file_format", ["gmsh22", "gmsh"])
def test_quadratic_meshes_keep_surfaces_and_curvature(tmp_path: Path, file_format: str):
    mesh = cylinder()
    if file_format == "gmsh":  # meshio writes physical names into version 4.1 only with entities
        mesh = with_entities(mesh)
    part = read(mesh, tmp_path / "c.msh", file_format)
    assert isinstance(part.mesh, MeshTet2)
    assert sorted(part.surfaces) == ["bottom", "mantle", "rest", "top"]
    assert patch(part, part.facets("mantle")).area == pytest.approx(np.pi, rel=1e-4)  # chords: 0.2 % too small
    np.testing.assert_allclose(patch(part, part.facets("top")).centroid[2], 2.0, rtol=1e-14)
    assert sum(c.dx.sum() for c in part.chunks()) == pytest.approx(0.75 * np.pi / 2, rel=1e-4)


def with_entities(mesh: meshio.Mesh) -> meshio.Mesh:
    """One entity per physical group, as version 4.1 of the format wants them."""
    dim_tags = np.tile([3, 1], (len(mesh.points), 1))
    for k in (4, 3, 2, 1):
        dim_tags[np.unique(mesh.cells[k].data)] = [2, k]
    return meshio.Mesh(
        mesh.points,
        mesh.cells,
        point_data={"gmsh:dim_tags": dim_tags},
        cell_data=mesh.cell_data,
        field_data=mesh.field_data,
    )


def test_linear_meshes_become_straight_sided_quadratic_ones(tmp_path: Path):
    part = read(cylinder(quadratic=False), tmp_path / "c.msh", "gmsh22")
    assert type(part.mesh) is MeshTet1
    assert part.elements.shape[1] == 10
    assert len(np.unique(part.elements)) == part.n
    assert patch(part, part.facets("mantle")).area == pytest.approx(2 * 7 * 2 * np.sin(np.pi / 28), rel=1e-12)


def test_gmsh_writes_what_we_read(tmp_path: Path):
    gmsh = pytest.importorskip("gmsh", exc_type=ImportError)
    try:
        gmsh.initialize()
    except OSError:
        pytest.skip("gmsh lacks its system libraries")
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addCylinder(0, 0, 0, 0, 0, 2, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [1], name="solid")
        gmsh.model.addPhysicalGroup(2, [1], name="mantle")
        gmsh.model.addPhysicalGroup(2, [2, 3], name="ends")
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.6)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        gmsh.write(str(tmp_path / "c.msh"))
    finally:
        gmsh.finalize()
    part = load_part_mesh("part", Part(material="steel", mesh="c.msh"), tmp_path)
    assert sorted(part.surfaces) == ["ends", "mantle"]
    assert patch(part, part.facets("mantle")).area == pytest.approx(4 * np.pi, rel=1e-4)
    assert sum(c.dx.sum() for c in part.chunks()) == pytest.approx(2 * np.pi, rel=1e-4)  # nodes 8 and 9 in order


@pytest.mark.parametrize("ending", ["vtu", "vtk", "mesh"])
def test_integer_tags_name_surfaces_where_a_format_has_no_names(tmp_path: Path, ending: str):
    mesh = cylinder(quadratic=False)
    tags = mesh.cell_data["gmsh:physical"]
    plain = meshio.Mesh(mesh.points, mesh.cells, cell_data={"medit:ref" if ending == "mesh" else "surface": tags})
    part = read(plain, tmp_path / f"c.{ending}")
    assert sorted(part.surfaces) == ["surface_1", "surface_2", "surface_3", "surface_4"]
    np.testing.assert_allclose(patch(part, part.facets("surface_2")).centroid[2], 2.0)


def test_cell_sets_name_surfaces(tmp_path: Path):
    mesh = cylinder(quadratic=False)
    sets = {name: [np.arange(len(b.data)) if k == i else [] for i, b in enumerate(mesh.cells)] for k, name in
            enumerate(("solid", "bottom", "top", "mantle", "rest"))}  # fmt: skip
    part = read(meshio.Mesh(mesh.points, mesh.cells, cell_sets=sets), tmp_path / "c.inp")
    assert sorted(n.lower() for n in part.surfaces) == ["bottom", "mantle", "rest", "top"]


def test_units_scale(tmp_path: Path):
    mesh = cylinder(quadratic=False)
    mesh.points = mesh.points * 1000.0
    part = read(mesh, tmp_path / "c.msh", "gmsh22", unit="mm")
    np.testing.assert_allclose(np.ptp(part.nodes, axis=0), [1.0, 1.0, 2.0])
    with pytest.raises(DescriptionError, match="unit of length"):
        read(mesh, tmp_path / "c.msh", "gmsh22", unit="kg")


def test_points_that_no_tetrahedron_uses_are_dropped(tmp_path: Path):
    mesh = cylinder()
    part = read(mesh, tmp_path / "c.msh", "gmsh22")
    mesh.points = np.vstack([[[9.0, 9.0, 9.0]], mesh.points])  # the first point: all numbers shift
    for block in mesh.cells:
        block.data = block.data + 1
    again = read(mesh, tmp_path / "d.msh", "gmsh22")
    np.testing.assert_array_equal(part.nodes, again.nodes)
    assert {k: list(v) for k, v in part.surfaces.items()} == {k: list(v) for k, v in again.surfaces.items()}


def fault(mesh: meshio.Mesh, path: Path) -> str:
    with pytest.raises(DescriptionError) as e:
        read(mesh, path, "gmsh22")
    assert all(str(path) in p.where and p.remedy for p in e.value.problems)
    return " | ".join(p.what for p in e.value.problems)


def test_a_named_surface_without_triangles_is_refused(tmp_path: Path):
    mesh = cylinder(quadratic=False)
    mesh.field_data["forgotten"] = np.array([17, 2])
    assert fault(mesh, tmp_path / "c.msh") == "surface 'forgotten' has no facets"


def test_outer_facets_without_a_name_are_refused(tmp_path: Path):
    mesh = cylinder(quadratic=False)
    keep = [0, 1, 3, 4]  # all but the top
    missing = len(mesh.cells[2].data)
    cells = [(mesh.cells[i].type, mesh.cells[i].data) for i in keep]
    data = {k: [v[i] for i in keep] for k, v in mesh.cell_data.items()}
    del mesh.field_data["top"]
    said = fault(meshio.Mesh(mesh.points, cells, cell_data=data, field_data=mesh.field_data), tmp_path / "c.msh")
    assert said.startswith(f"{missing} of ")
    assert "outer facets belong to no named surface" in said
    assert ", 2) m" in said  # the centroid shows where


def test_inner_faces_are_refused(tmp_path: Path):
    mesh = cylinder(quadratic=False)
    tetra = mesh.cells[0].data
    inner = next(t for t in tetra[:, [0, 1, 2]] if (np.isin(tetra, t).sum(axis=1) == 3).sum() == 2)
    mesh.cells[2].data = np.vstack([mesh.cells[2].data, [inner]])
    for name in mesh.cell_data:
        mesh.cell_data[name][2] = np.append(mesh.cell_data[name][2], 2)
    assert "1 of 29 triangles of surface 'top' are no outer faces" in fault(mesh, tmp_path / "c.msh")


def test_surface_meshes_and_geometries_are_refused(tmp_path: Path):
    mesh = cylinder(quadratic=False)
    data = {k: v[1:] for k, v in mesh.cell_data.items()}
    shell = meshio.Mesh(mesh.points, mesh.cells[1:], cell_data=data, field_data=mesh.field_data)
    assert fault(shell, tmp_path / "c.msh") == "the mesh has no solids, only triangle"
    (tmp_path / "c.step").write_text("ISO-10303-21;")
    with pytest.raises(DescriptionError, match="is a geometry and no mesh"):
        load_part_mesh("part", Part(material="steel", mesh="c.step"), tmp_path)


@pytest.mark.parametrize(
    ("name", "content"), [("c.msh", b"$MeshFormat\n4.1 0"), ("c.xyz", b""), ("c.vtu", b"<VTKFile")]
)
def test_files_that_cannot_be_read_are_refused(tmp_path: Path, name: str, content: bytes):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(DescriptionError, match="cannot be read as a mesh"):
        load_part_mesh("part", Part(material="steel", mesh=name), tmp_path)
