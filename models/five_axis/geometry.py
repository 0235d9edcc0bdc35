"""Mesh the five-axis machining centre: `python geometry.py --size 0.12 -o mesh` writes one mesh/<part>.msh per part.

Straight-sided linear tetrahedra (the assembly raises them to quadratic), gmsh 4.1 binary. The solid carries the part's
name and every outer face exactly one named surface. The same size gives the same files with the same gmsh.
Needs gmsh >= 4.11 (`pip install gmsh`; on a bare Debian also libglu1-mesa libgl1 libxft2 libxcursor1 libxinerama1).
The shapes are in solids.py.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import gmsh
from csg import Patch, Point, Prism, Region, Solid
from solids import solids

TOLERANCE = 1e-5  # m; faces are distinguished by features of tens of millimetres


def _surface(polygon: tuple[Point, ...]) -> int:
    occ = gmsh.model.occ
    points = [occ.addPoint(*p) for p in polygon]
    lines = [occ.addLine(a, b) for a, b in zip(points, points[1:] + points[:1], strict=True)]
    return occ.addPlaneSurface([occ.addCurveLoop(lines)])


def _volume(prism: Prism, layers: int = 0) -> tuple[int, int]:
    swept = gmsh.model.occ.extrude([(2, _surface(prism.polygon))], *prism.sweep, numElements=[layers] if layers else [])
    return next(entity for entity in swept if entity[0] == 3)


def build(solid: Solid, size: float) -> int:
    """The solid in gmsh's kernel with its patches imprinted; returns its volume tag.

    Bars are swept in layers of two thirds of the mesh size: a free mesh of a slim bar would be needlessly fine.
    """
    occ = gmsh.model.occ
    layers = math.ceil(1.5 * math.hypot(*solid.add[0].sweep) / size) if solid.bar else 0
    body = [_volume(solid.add[0], layers)]
    if len(solid.add) > 1:
        body, _ = occ.fuse(body, [_volume(p) for p in solid.add[1:]])
    if solid.cut:
        body, _ = occ.cut(body, [_volume(p) for p in solid.cut])
    if solid.patches:
        occ.fragment(body, [(2, _surface(p.polygon)) for p in solid.patches])
    occ.synchronize()
    volumes = gmsh.model.getEntities(3)
    if len(volumes) != 1:
        raise RuntimeError(f"{solid.name}: the blocks make {len(volumes)} separate solids, expected one")
    return volumes[0][1]


def _as_region(patch: Patch) -> Region:
    x, y, z = zip(*patch.polygon, strict=True)
    return Region(patch.name, (min(x), min(y), min(z)), (max(x), max(y), max(z)))


def name_faces(solid: Solid, volume: int) -> dict[str, list[int]]:
    """Face tags under each surface name. Raises RuntimeError for a name without a face."""
    regions = [*map(_as_region, solid.patches), *solid.regions]
    faces: dict[str, list[int]] = {name: [] for name in (*(r.name for r in regions), solid.rest)}
    for _, tag in gmsh.model.getBoundary([(3, volume)], oriented=False):
        box = gmsh.model.getBoundingBox(2, tag)
        inside = (
            r.name
            for r in regions
            if all(box[i] >= r.low[i] - TOLERANCE and box[i + 3] <= r.high[i] + TOLERANCE for i in range(3))
        )
        faces[next(inside, solid.rest)].append(tag)
    empty = [name for name, tags in faces.items() if not tags]
    if empty:
        raise RuntimeError(f"{solid.name}: no face for the surfaces {', '.join(empty)}")
    return faces


def write_mesh(solid: Solid, size: float, folder: Path) -> tuple[int, int]:
    """Mesh one part with edges of about `size` [m]; returns the numbers of nodes and tetrahedra."""
    gmsh.model.add(solid.name)
    volume = build(solid, size)
    for name, tags in name_faces(solid, volume).items():
        gmsh.model.addPhysicalGroup(2, tags, name=name)
    gmsh.model.addPhysicalGroup(3, [volume], name=solid.name)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.model.mesh.generate(3)
    gmsh.write(str(folder / f"{solid.name}.msh"))
    nodes = len(gmsh.model.mesh.getNodes()[0])
    tetrahedra = len(gmsh.model.mesh.getElementsByType(4)[0])
    gmsh.model.remove()
    return nodes, tetrahedra


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=float, default=0.12, help="edge length of the tetrahedra [m], default 0.12")
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).parent / "mesh", help="folder to write to")
    arguments = parser.parse_args()
    if not 0.02 <= arguments.size <= 0.3:
        parser.error("--size is in metres and must lie between 0.02 and 0.3")
    arguments.output.mkdir(parents=True, exist_ok=True)
    gmsh.initialize(["-noenv"], readConfigFiles=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)  # several threads would number elements in changing order
        gmsh.option.setNumber("Mesh.Algorithm3D", 10)  # HXT: no slivers between the thin walls of the castings
        gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
        gmsh.option.setNumber("Mesh.Binary", 1)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)  # a small face must not refine the solid behind it
        for solid in solids():
            nodes, tetrahedra = write_mesh(solid, arguments.size, arguments.output)
            print(f"{solid.name:10s} {nodes:6d} nodes {tetrahedra:6d} tetrahedra")
    finally:
        gmsh.finalize()


if __name__ == "__main__":
    main()
