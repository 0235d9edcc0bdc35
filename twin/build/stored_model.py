"""A full model as plain data, for the cache: meshes by their points and tetrahedra, which are numbered anew on reading.

The numbers of edges, facets and unknowns follow from the tetrahedra alone, so they are the same again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from skfem import ElementTetP2, MeshTet1, MeshTet2
from skfem.assembly import Dofs

from twin.build.full_model import FullModel, SurfaceMesh
from twin.build.mesh import BodyMesh, PartMesh, body_mesh
from twin.build.structure import Structure
from twin.rom.lumped_structure import LumpedStructure
from twin.rom.model import MachineModel


@dataclass(frozen=True)
class StoredPart:
    """What a `PartMesh` follows from."""

    name: str
    curved: bool  # MeshTet2
    points: np.ndarray  # (3, k) m
    tetra: np.ndarray  # (4, m) vertices
    surfaces: Mapping[str, np.ndarray]
    nodes: np.ndarray  # (n, 3) m


@dataclass(frozen=True)
class StoredModel:
    """What a `FullModel` follows from."""

    thermal: MachineModel
    structure: Structure | LumpedStructure
    bodies: tuple[tuple[str, tuple[StoredPart, ...]], ...]  # name and parts
    surfaces: tuple[SurfaceMesh, ...]


def stored(full: FullModel) -> StoredModel:
    bodies = tuple((body.name, tuple(_stored_part(part) for part in body.parts)) for body in full.bodies)
    return StoredModel(full.thermal, full.structure, bodies, full.surfaces)


def restored(model: StoredModel) -> FullModel:
    """The full model that `stored` was given."""
    bodies = tuple(_body(name, parts) for name, parts in model.bodies)
    return FullModel(model.thermal, model.structure, bodies, model.surfaces)


def _stored_part(part: PartMesh) -> StoredPart:
    mesh = part.mesh
    return StoredPart(part.name, isinstance(mesh, MeshTet2), mesh.doflocs, mesh.t, dict(part.surfaces), part.nodes)


def _body(name: str, parts: tuple[StoredPart, ...]) -> BodyMesh:
    return body_mesh(name, tuple(_part(part) for part in parts))


def _part(part: StoredPart) -> PartMesh:
    mesh = (MeshTet2 if part.curved else MeshTet1)(part.points, part.tetra)
    return PartMesh(part.name, mesh, part.surfaces, Dofs(mesh, ElementTetP2()), part.nodes)
