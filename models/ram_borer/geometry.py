"""Mesh the castings of the ram borer: `python geometry.py --size 0.26 -o mesh` writes bed, column and headstock.

No mesher is needed: the castings are unions of boxes (solids.py) on a grid of planes (grid.py). Straight-sided linear
tetrahedra, which the assembly raises to quadratic; the same size gives the same files. The other parts are boxes given
in machine.toml; --size does not touch them. Needs numpy and meshio.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import meshio
import numpy as np
from grid import Tetrahedra, mesh
from solids import castings


def write(path: Path, name: str, solid: Tetrahedra) -> None:
    """A gmsh 2.2 file with the volume and its surfaces as physical groups."""
    tags = {surface: tag for tag, surface in enumerate(solid.surfaces, start=1)}
    blocks = [("triangle", faces) for faces in solid.surfaces.values()] + [("tetra", solid.cells)]
    physical = [np.full(len(faces), tags[surface]) for surface, faces in solid.surfaces.items()]
    physical.append(np.full(len(solid.cells), len(tags) + 1))
    groups = {surface: np.array([tag, 2]) for surface, tag in tags.items()} | {name: np.array([len(tags) + 1, 3])}
    data = meshio.Mesh(
        solid.points,
        blocks,
        cell_data={"gmsh:physical": physical, "gmsh:geometrical": physical},
        field_data=groups,
    )
    meshio.write(path, data, file_format="gmsh22", binary=False, float_fmt=".6g")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--size", type=float, default=0.26, help="edge length of the cells [m], default 0.26")
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).parent / "mesh", help="folder to write to")
    arguments = parser.parse_args()
    if not 0.05 <= arguments.size <= 0.6:
        parser.error("--size is in metres and must lie between 0.05 and 0.6")
    arguments.output.mkdir(parents=True, exist_ok=True)
    for casting in castings():
        solid = mesh(casting, arguments.size)
        write(arguments.output / f"{casting.name}.msh", casting.name, solid)
        print(f"{casting.name:10s} {len(solid.points):6d} nodes {len(solid.cells):6d} tetrahedra")


if __name__ == "__main__":
    main()
