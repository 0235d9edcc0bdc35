"""Meshes as other programs write them: every named face arrives, of the right size and in the right place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from skfem import CellBasis, ElementTetP2, MeshTet1, MeshTet2

from twin.build.mesh import PartMesh, load_part_mesh
from twin.build.mesh_formats.solid_file import SHAPES, Solids, from_numbers, outer_sides
from twin.build.mesh_formats.tetrahedra import tetrahedra, triangles
from twin.build.surface import patch
from twin.errors import DescriptionError
from twin.machine.description import Part

MESHES = Path(__file__).parent / "meshes"  # a quarter of a ring; make.py says how they were made
NUMBERS = {"surface_1": "cut", "surface_2": "outer", "surface_3": "inner", "surface_4": "bottom", "surface_5": "top"}
BASE = np.pi / 4 * (40.0**2 - 20.0**2)
AREAS = {"bottom": BASE, "top": BASE, "inner": np.pi / 2 * 20 * 30, "outer": np.pi / 2 * 40 * 30, "cut": 2 * 20 * 30}
HEIGHTS = {"bottom": 0.0, "top": 30.0, "inner": 15.0, "outer": 15.0, "cut": 15.0}  # mm, of centroids


def load(folder: Path, name: str, unit: str = "mm") -> PartMesh:
    return load_part_mesh("ring", Part(material="steel", mesh=name, mesh_unit=unit), folder)


def named(part: PartMesh) -> dict[str, np.ndarray]:
    """Facets by name: formats without names have numbers, Ansys capitals."""
    return {NUMBERS.get(name, name.lower()): facets for name, facets in part.surfaces.items()}


def volume(part: PartMesh) -> float:
    return float(sum(c.dx.sum() for c in part.chunks()))


@pytest.mark.parametrize("path", sorted(p for p in MESHES.iterdir() if p.suffix != ".py"), ids=lambda p: p.name)
def test_every_format_keeps_its_named_faces(path: Path):
    part = load(MESHES, path.name)
    curved = path.stem.startswith(("tetra2", "mixed2"))
    assert type(part.mesh) is (MeshTet2 if curved else MeshTet1)
    off = 5e-5 if curved else 1e-2  # eight chords around are 0.6 % short; the middles of edges follow the curve
    found = named(part)
    assert found.keys() == AREAS.keys()
    for name, facets in found.items():
        surface = patch(part, facets)
        assert surface.area == pytest.approx(AREAS[name] * 1e-6, rel=off), name
        assert surface.centroid[2] == pytest.approx(HEIGHTS[name] * 1e-3, abs=1e-6), name
    assert volume(part) == pytest.approx(BASE * 30e-9, rel=off)


def test_the_ways_of_naming_agree_facet_by_facet():
    """The Ansys archive names by nodes, the others by shell elements: the same facets of the same tetrahedra."""
    first, second = load(MESHES, "mixed2.inp"), load(MESHES, "mixed2.cdb")
    for name, facets in named(first).items():
        here = np.sort(first.mesh.p[:, first.mesh.facets[:3, facets]].mean(axis=1), axis=1)
        there = np.sort(second.mesh.p[:, second.mesh.facets[:3, named(second)[name]]].mean(axis=1), axis=1)
        np.testing.assert_allclose(here, there, atol=1e-9)


BEAM = """*NODE, NSET=ALL
 1, 0., 0., 0.
 2, 1., 0., 0.
 3, 1., 2., 0.
 4, 0., 2., 0.
 5, 0., 0., 3.
 6, 1., 0., 3.
 7, 1., 2., 3.
 8, 0., 2., 3.
 9, 0., 1., 5.
10, 1., 1., 5.
*ELEMENT, TYPE=C3D8, ELSET=BLOCK
1, 1, 2, 3, 4,
5, 6, 7, 8
*ELEMENT, TYPE=C3D6, ELSET=ROOF
2, 5, 8, 9, 6, 7, 10
"""
# The ccx manual, C3D8: S1 1-2-3-4, S2 5-8-7-6, S3 1-5-6-2, S4 2-6-7-3, S5 3-7-8-4, S6 4-8-5-1;
# C3D6: S1 1-2-3, S2 4-6-5, S3 1-2-5-4, S4 2-3-6-5, S5 3-1-4-6. S3 of the roof lies on S2 of the block.
SURFACES = """*SURFACE, NAME=floor, TYPE=ELEMENT
BLOCK, S1
*SURFACE, NAME=front
1, S3
*SURFACE, NAME=right
1, S4
2, S2
*Surface, type=ELEMENT, name=back
1, S5
*ELSET, ELSET=both, GENERATE
1, 2, 1
*SURFACE, NAME=left
1, S6
roof, S1
*SURFACE, NAME=pitch_1
ROOF, S4
*SURFACE, NAME=pitch_2
ROOF, S5
*NSET, NSET=base
1, 2, 3,
4
*NSET, NSET=ridge
9, 10
"""


def test_surfaces_of_calculix_are_sides_of_solids(tmp_path: Path):
    (tmp_path / "house.inp").write_text(BEAM + SURFACES)
    part = load(tmp_path, "house.inp", "m")
    areas = {name: patch(part, facets).area for name, facets in part.surfaces.items()}
    slope = 5**0.5
    expected = {"floor": 2, "front": 3, "right": 8, "back": 3, "left": 8, "pitch_1": slope, "pitch_2": slope}
    assert areas == pytest.approx(expected)  # the sets of nodes say nothing more
    assert patch(part, part.facets("pitch_1")).centroid[1] == pytest.approx(1.5)
    assert patch(part, part.facets("right")).centroid[0] == pytest.approx(1.0)
    assert volume(part) == pytest.approx(8.0)


def test_sets_of_nodes_name_what_no_surface_names(tmp_path: Path):
    text = BEAM + SURFACES.replace("*SURFACE, NAME=floor, TYPE=ELEMENT\nBLOCK, S1\n", "")
    (tmp_path / "house.inp").write_text(text)
    part = load(tmp_path, "house.inp", "m")
    assert patch(part, part.facets("base")).area == pytest.approx(2.0)
    (tmp_path / "house.inp").write_text(text.replace("1, 2, 3,\n4", "1, 2, 3, 4, 5, 6"))
    with pytest.raises(DescriptionError, match="2 facets belong to more than one of the surfaces base, front"):
        load(tmp_path, "house.inp", "m")


def test_an_assembly_of_abaqus_moves_its_part(tmp_path: Path):
    surfaces = (
        SURFACES.replace("BLOCK, S1", "_floor_S1, S1").replace("ROOF", "Part-1-1.ROOF").replace("roof, S1", "2, S1")
    )
    (tmp_path / "house.inp").write_text(
        f"*Heading\n** by hand\n*Part, name=Part-1\n{BEAM}*End Part\n*Assembly, name=A\n*Instance, name=Part-1-1, "
        f"part=Part-1\n 0., 0., 10.\n*End Instance\n*Node\n 1, 9., 9., 9.\n"
        f"*Elset, elset=_floor_S1, internal,\n instance=Part-1-1\n 1,\n{surfaces}*End Assembly\n"
    )
    part = load(tmp_path, "house.inp", "m")
    assert patch(part, part.facets("floor")).centroid == pytest.approx([0.5, 1.0, 10.0])
    assert len(part.surfaces) == 7


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (BEAM.replace("*NODE", "*PART\n*NODE") + "*END PART\n*PART\n", "several parts"),
        (BEAM + "*INSTANCE\n1, 0, 0\n0, 0, 0, 0, 0, 1, 90\n", "rotated"),
        (BEAM + "*SURFACE, NAME=x, COMBINE=UNION\na, b\n", "'x' is combined of others"),
        (BEAM + "*SURFACE, NAME=x\nnothing, S1\n", "set 'nothing' is used and not defined"),
        (BEAM + "*SURFACE, NAME=x\n2, S6\n", "a wedge has no side S6"),
        (BEAM.replace("2, 5, 8, 9", "2, 5, 8, 77"), "number 77 is used and not defined"),
        (BEAM + "*INCLUDE, INPUT=more.inp\n", "includes 'more.inp', which is not beside it"),
    ],
)
def test_what_abaqus_files_are_refused_for(tmp_path: Path, text: str, said: str):
    (tmp_path / "house.inp").write_text(text)
    with pytest.raises(DescriptionError, match=f"cannot be read as a mesh: .*{said}"):
        load(tmp_path, "house.inp", "m")


# The same house in small, large and free fields.
NASTRAN = """SOL 101
CEND
BEGIN BULK
$HMNAME LOADCOL               11"floor"
$ Femap with NX Nastran Load Set 12 : front
$ANSA_NAME_COMMENT;5;PSHELL;left side;;NO;NO;NO;NO;
$HMNAME PROP 6 "left side"
GRID    1               0.      0.      0.
GRID*   2                               1.              0.
*       0.
GRID,3,,1.,2.,0.0
GRID    4               0.0     .2+1    0.
GRID    5               0.      0.      3.
GRID    6               1.      0.      3.
GRID    7               1.      2.      3.
GRID    8               0.      2.      3.
GRID    9               0.      1.      5.
GRID    10              1.      1.      5.
CHEXA   1       1       1       2       3       4       5       6       +A
+A      7       8
CPENTA  2       1       5       8       9       6       7       10
CQUAD4  30      5       1       5       8       4
CTRIA3  31      6       5       8       9
PLOAD4  11      1       1.                              1       3
PLOAD4  12      1       1.                              1       6
PLOAD4  13      1       1.                              3       6
PLOAD4  13      2       1.                              6
PLOAD4  14      1       1.                              3       8
BSURFS  21                              2       8       9       10
BSURFS  22                              2       5       9       6
ENDDATA
"""


def test_loads_regions_and_properties_of_nastran_name_faces(tmp_path: Path):
    (tmp_path / "house.bdf").write_text(NASTRAN)
    part = load(tmp_path, "house.bdf", "m")
    areas = {name: patch(part, facets).area for name, facets in part.surfaces.items()}
    slope = 5**0.5
    expected = {"floor": 2, "front": 3, "surface_13": 8, "surface_14": 3, "left side": 8,
                "surface_21": slope, "surface_22": slope}  # fmt: skip
    assert areas == pytest.approx(expected)
    assert patch(part, part.facets("surface_13")).centroid[0] == pytest.approx(1.0)
    assert volume(part) == pytest.approx(8.0)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("GRID    1       ", "GRID    1       7", "line 8, GRID: a point in coordinate system 7"),
        ("ENDDATA", "INCLUDE 'x.bdf'\nENDDATA", "INCLUDE: it includes another file"),
        ("1       3\n", "1       7\n", "PLOAD4 of element 1 names no side by points 1 and 7"),
        ("PLOAD4  11      1", "PLOAD4  11      9", "element 9, which is not there"),
        ("7       8\n", "7       99\n", "number 99 is used and not defined"),
        ("CQUAD4  30      5       1       5       8       4", "CQUAD4", "line 22, CQUAD4"),
    ],
)
def test_what_nastran_files_are_refused_for(tmp_path: Path, old: str, new: str, said: str):
    (tmp_path / "house.bdf").write_text(NASTRAN.replace(old, new, 1))
    with pytest.raises(DescriptionError, match=f"cannot be read as a mesh: .*{said}"):
        load(tmp_path, "house.bdf", "m")


def test_components_of_surface_elements_and_collapsed_hexahedra_of_ansys(tmp_path: Path):
    """A wedge written as a hexahedron with K = L and O = P; the top as a SURF152 with an extra node."""

    def element(*fields: int) -> str:
        return "".join(f"{f:9d}" for f in fields)

    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 2), (1, 0, 2), (0, 1, 2)]
    lines = ["ET,1,278", "ET,2,152", "NBLOCK,6,SOLID,7,7", "(3i9,6e21.13e3)"]
    lines += [element(i, 0, 0) + "".join(f"{c:21.13E}" for c in np.trim_zeros(np.array(p, float), "b"))
              for i, p in enumerate(points, 1)]  # fmt: skip
    lines += [element(7, 0, 0) + f"{9:21.13E}", "N,R5.3,LOC,       -1,"]
    lines += ["EBLOCK,19,SOLID,3,3", "(19i9)", element(1, 1, 1, 1, 0, 0, 0, 0, 8, 0, 1, 1, 2, 3, 3, 4, 5, 6, 6)]
    lines += [element(1, 2, 1, 1, 0, 0, 0, 0, 5, 0, 2, 4, 5, 6, 6, 7), element(-1)]
    lines += ["CMBLOCK,LID,ELEM,1", "(8i10)", f"{2:10d}"]
    lines += ["CMBLOCK,FLOOR,NODE,2", "(8i10)", f"{1:10d}{-3:10d}"]  # 1 to 3
    lines += ["CMBLOCK,SIDES,NODE,4  ! not the skew one", "(8i10)", "".join(f"{n:10d}" for n in (1, 2, 4, 5))]
    lines += ["CMBLOCK,REST,NODE,6", "(8i10)", "".join(f"{n:10d}" for n in (1, 3, 4, 6, 7, 7))]
    lines += ["CMBLOCK,SKEW,NODE,4", "(8i10)", "".join(f"{n:10d}" for n in (2, 3, 5, 6))]
    (tmp_path / "w.cdb").write_text("\n".join(lines) + "\n")
    part = load(tmp_path, "w.cdb", "m")
    areas = {name: patch(part, facets).area for name, facets in part.surfaces.items()}
    assert areas == pytest.approx({"LID": 0.5, "FLOOR": 0.5, "SIDES": 2, "REST": 2, "SKEW": 2 * 2**0.5})
    assert volume(part) == pytest.approx(1.0)


def test_solids_of_all_shapes_fit_after_division():
    """A hexahedron, a pyramid on it, wedges and tetrahedra beside, at random numbers: no gap, no overlap."""
    rng = np.random.default_rng(3)
    corners = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1, 2)], dtype=float)
    points = np.vstack([corners, [(0.5, 0.5, 1.8), (1.6, 0.4, 1.9)]])
    solids = {
        "hexahedron": [[0, 1, 4, 3, 6, 7, 10, 9]], "wedge": [[1, 2, 5, 7, 8, 11], [1, 5, 4, 7, 11, 10]],
        "pyramid": [[6, 7, 10, 9, 12]], "tetra": [[7, 8, 11, 13]],
    }  # fmt: skip
    for _ in range(20):
        order = rng.permutation(len(points))
        place = np.argsort(order)
        pieces = [Solids(shape, place[np.array(cells)]) for shape, cells in solids.items()]
        at, tetra = tetrahedra(points[order], pieces)
        assert len(at) == len(points)
        edges = at[tetra[:, 1:]] - at[tetra[:, :1]]
        volumes = np.einsum("mi,mi->m", np.cross(edges[:, 0], edges[:, 1]), edges[:, 2]) / 6
        assert (volumes > 1e-3).all()
        # the lone tetrahedron: base 7 8 11 of half a unit, 0.9 high
        assert volumes.sum() == pytest.approx(2.0 + 0.8 / 3 + 0.5 * 0.9 / 3)
        expected = np.vstack([triangles(s) for s in outer_sides(pieces).values()])
        found = outer_sides([Solids("tetra", tetra)])[3]
        np.testing.assert_array_equal(np.unique(np.sort(found, axis=1), axis=0),
                                      np.unique(np.sort(expected, axis=1), axis=0))  # fmt: skip


def test_middles_are_those_of_the_solids_own_map():
    """A hexahedron bent by a quadratic map keeps its volume; one middle left out is that of a straight edge."""
    shape = SHAPES["hexahedron"]
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
    points = np.vstack([corners, corners[np.array(shape.edges)].mean(axis=1)])
    bent = points + np.column_stack([0.3 * points[:, 1] ** 2, 0 * points[:, 0], 0.2 * points[:, 0] ** 2])
    at, tetra = tetrahedra(bent, [Solids("hexahedron", np.arange(20)[None])])
    mesh = MeshTet2(np.ascontiguousarray(at.T), np.ascontiguousarray(tetra.T))
    assert CellBasis(mesh, ElementTetP2(), intorder=6).dx.sum() == pytest.approx(1.0, abs=1e-12)
    missing = np.arange(20)[None].copy()
    missing[0, 8] = -1
    again, _ = tetrahedra(points, [Solids("hexahedron", missing)])
    assert np.abs(again - points[8]).sum(axis=1).min() == pytest.approx(0.0, abs=1e-15)


def test_middles_in_an_unknown_order_are_refused(tmp_path: Path):
    text = (MESHES / "tetra2.inp").read_text().splitlines()
    begin = next(i for i, line in enumerate(text) if "C3D10" in line) + 1
    fields = text[begin].split(", ")
    fields[5], fields[6] = fields[6], fields[5]
    text[begin] = ", ".join(fields)
    (tmp_path / "ring.inp").write_text("\n".join(text))
    with pytest.raises(DescriptionError, match="2 mid-edge nodes lie far from the middle of their edge"):
        load(tmp_path, "ring.inp")


def test_numbers_that_no_point_has_are_told():
    np.testing.assert_array_equal(from_numbers(np.array([5, 3, 9]), np.array([[9, 0], [3, 5]])), [[2, -1], [1, 0]])
    with pytest.raises(ValueError, match="number 4 is used"):
        from_numbers(np.array([5, 3, 9]), np.array([4]))


@pytest.mark.parametrize("ending", ["inp", "bdf", "unv", "cdb"])
def test_files_that_end_early_are_refused_or_no_set_is_short(tmp_path: Path, ending: str):
    """Cut anywhere, a file is refused with its name, or no set is short of faces: never another exception."""
    text = (MESHES / f"mixed1.{ending}").read_text()
    whole = {name: len(facets) for name, facets in named(load(MESHES, f"mixed1.{ending}")).items()}
    for share in np.linspace(0.02, 0.98, 25):
        path = tmp_path / f"ring.{ending}"
        path.write_text(text[: int(share * len(text))])
        found, problems = {}, ()
        try:
            found = named(load(tmp_path, path.name))
        except DescriptionError as e:
            problems = e.problems
        assert found or problems
        assert all(str(path) in p.where and p.remedy for p in problems)
        # without its own set, a face has the name of its block of elements; no set arrives in part
        assert all(len(facets) == whole[name] for name, facets in found.items() if name in whole)
