"""The full model of a machine: thermal bodies with TCP rows, and the structure for poses off the grid."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from twin.build.elastic_inputs import elastic_inputs
from twin.build.linear import linear_body, straightened
from twin.build.lumped import assemble_lumped, lumped_bodies
from twin.build.lumped_structure import lumped_structure
from twin.build.mesh import BodyMesh, load_body_meshes
from twin.build.structure import Structure, assemble_structure
from twin.build.thermal import assemble_thermal
from twin.machine.description import Machine
from twin.progress import Progress, silent
from twin.rom.lumped_structure import LumpedStructure
from twin.rom.model import MachineModel


@dataclass(frozen=True)
class SurfaceMesh:
    """The outer surface of a body, for pictures: flat triangles between vertices of the mesh."""

    points: np.ndarray  # (m, 3) m
    triangles: np.ndarray  # (k, 3) rows of `points`


@dataclass(frozen=True)
class FullModel:
    thermal: MachineModel  # sparse bodies, G filled for the pose grid, W for all positions, F for their surfaces
    structure: Structure | LumpedStructure  # the latter, with nothing that moves, of machines without a TCP
    bodies: tuple[BodyMesh, ...]  # none of a lumped machine
    surfaces: tuple[SurfaceMesh, ...]  # likewise


def assemble(machine: Machine, progress: Progress = silent) -> FullModel:
    """Read meshes, assemble and condense, or assemble nodes and bars. Raises DescriptionError and ModelError."""
    if machine.lumped:
        return _assemble_lumped(machine)
    with progress("meshes", 1) as advance:
        bodies = load_body_meshes(machine)
        advance("meshes")
    return assemble_meshed(machine, bodies, progress)


def assemble_meshed(
    machine: Machine, bodies: tuple[BodyMesh, ...], progress: Progress = silent, linear: bool = False
) -> FullModel:
    """The full model on these meshes of the bodies, in the order of `bodies_of`; raises as `assemble`.

    linear: with linear elements on the same tetrahedra, faces flat (`twin.build.linear`).
    """
    full = assemble_unrestricted(machine, bodies, progress, linear)
    return with_linear_temperatures(full) if linear else full


def with_linear_temperatures(full: FullModel) -> FullModel:
    """The full model with its temperatures restricted to linear elements."""
    bodies = tuple(linear_body(mesh, body) for mesh, body in zip(full.bodies, full.thermal.bodies, strict=True))
    return replace(full, thermal=replace(full.thermal, bodies=bodies))


def assemble_unrestricted(
    machine: Machine, bodies: tuple[BodyMesh, ...], progress: Progress = silent, linear: bool = False
) -> FullModel:
    """As `assemble_meshed`, but temperatures stay quadratic: more may be added before they are restricted."""
    bodies = tuple(straightened(body) for body in bodies) if linear else bodies
    with progress("thermal matrices", 1) as advance:
        thermal = assemble_thermal(machine, bodies)
        advance("thermal matrices")
    structure: Structure | LumpedStructure
    if machine.has_tcp:
        structure = assemble_structure(machine, bodies, progress, linear)
    else:
        structure = LumpedStructure(thermal.pose_axes, tuple(np.zeros((3, body.n)) for body in thermal.bodies), ())
    rows = structure.pose_rows(thermal.poses)
    meshes = zip(bodies, thermal.bodies, strict=True)
    surfaces, selections = zip(*(_surface(mesh, body.n) for mesh, body in meshes), strict=True)
    acting, inputs = elastic_inputs(structure)
    parts = zip(thermal.bodies, rows, inputs, selections, strict=True)
    full = tuple(replace(b, G=G, W=W, F=F) for b, G, W, F in parts)
    thermal = replace(thermal, bodies=full, structure=acting)
    return FullModel(thermal, structure, bodies, surfaces)


def _assemble_lumped(machine: Machine) -> FullModel:
    bodies = lumped_bodies(machine)
    thermal = assemble_lumped(machine, bodies)
    structure = lumped_structure(machine, bodies)
    rows = structure.pose_rows(thermal.poses)
    acting, inputs = elastic_inputs(structure)
    parts = zip(thermal.bodies, rows, inputs, strict=True)
    full = tuple(replace(b, G=G, W=W) for b, G, W in parts)
    return FullModel(replace(thermal, bodies=full, structure=acting), structure, (), ())


def _surface(body: BodyMesh, n: int) -> tuple[SurfaceMesh, sp.csr_array]:
    """Surface triangles of a body and the (m, n) selection of its vertices among the states."""
    triangles = np.vstack(
        [
            part.mesh.facets[:, part.mesh.boundary_facets()].T + offset
            for part, offset in zip(body.parts, body.offsets, strict=True)
        ]
    )
    vertices, index = np.unique(triangles, return_inverse=True)
    selection = sp.csr_array((np.ones(len(vertices)), (np.arange(len(vertices)), vertices)), (len(vertices), n))
    return SurfaceMesh(body.nodes[vertices], index.reshape(triangles.shape)), selection
