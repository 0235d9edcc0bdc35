"""Box-shaped parts and bodies for the tests of this folder."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from twin.build.mesh import BodyMesh, PartMesh, body_mesh, load_part_mesh
from twin.machine.description import Box, Material, Part

STEEL = Material(
    conductivity=45.0,
    density=7850.0,
    heat_capacity=470.0,
    youngs_modulus=210e9,
    poisson_ratio=0.3,
    expansion=11.5e-6,
)


def box(
    name: str, origin: tuple[float, float, float], size: tuple[float, float, float], divisions: tuple[int, int, int]
) -> PartMesh:
    part = Part(material="steel", box=Box(origin=origin, size=size, divisions=divisions))
    return load_part_mesh(name, part, Path())


def stacked(divisions_a: tuple[int, int, int], divisions_b: tuple[int, int, int]) -> BodyMesh:
    """Two unit-square blocks on each other, 0.2 m and 0.3 m high, whose meshes do not match."""
    a = box("a", (0.0, 0.0, 0.0), (1.0, 1.0, 0.2), divisions_a)
    b = box("b", (0.0, 0.0, 0.2), (1.0, 1.0, 0.3), divisions_b)
    return body_mesh("a", (a, b))


def linear(points: np.ndarray) -> np.ndarray:
    """A linear field with no symmetry: 1 + 2 x - 3 y + 0.5 z."""
    return 1.0 + points @ np.array([2.0, -3.0, 0.5])
