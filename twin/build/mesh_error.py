"""The error of the mesh: how far the full model is from the solution of its equations, per output.

The full model is compared with itself on a finer mesh, every tetrahedron in eight (`twin.build.refine`), and the
difference extrapolated (Richardson 1911; Roache, J. Fluids Eng. 116, 1994): where the error goes with h^p,

    error = difference to the mesh of half the size / (1 - 2^-p)

p = 4/3 is the order of an output in the presence of an edge that re-enters at a right angle, as on every casting and
beside every pad: the solution behaves as r^(2/3) there, in the energy norm h^(2/3), and an output has twice that, from
its own error and its adjoint's (Strang, Fix, An analysis of the finite element method, 1973, chapters 3 and 8; Grisvard
1985). Quadratic elements have 4 where all is smooth, which the refinement shows too: the factor, 1.66, is at most 1.6
times too large. It is too small where p < 4/3: below p = 0.73 less than half of the error is told.

Measured against a mesh of a quarter of the size (2,121, 12,459 and 84,327 nodes of tests/machines/slide, what is left
there extrapolated likewise): 0.8 to 1.2 times the true error of every sensor and component.

Where the finer model does not fit, the full model is compared with linear elements on its own mesh instead. It has the
nodes of linear elements of half the size, so with the same order

    error = difference to linear elements / (2^p - 1)

This is an indication only: on three machines 0.15 to 11 times what the finer mesh shows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twin.build.certificate import MESH, Part
from twin.build.comparison import Comparison, Way, compare_ways
from twin.build.factorize import MEMORY_SHARE, predicted_bytes
from twin.build.full_model import FullModel, assemble_meshed
from twin.build.memory import available_memory
from twin.build.mesh import BodyMesh, body_mesh
from twin.build.refine import refined, refined_size
from twin.build.scenario import Scenario
from twin.build.workers import LONG
from twin.errors import DescriptionError
from twin.machine.description import Machine
from twin.progress import Progress, silent
from twin.rom.model import MachineModel

ORDER = 4.0 / 3.0
OF_FINER = 1.0 / (1.0 - 2.0**-ORDER)  # 1.66
OF_LINEAR = 1.0 / (2.0**ORDER - 1.0)  # 0.66
SCENARIOS = 2  # held-out ones with their steady states: each steps a model eight times as large
# Elastic unknowns of a body whose factor takes minutes (measured: 841,000 take six); the time goes with their square.
LARGEST = 1_000_000
# Entries in a row of the matrices of quadratic tetrahedra, in the mean: measured on machines refined once.
THERMAL_ROW, ELASTIC_ROW = 28, 84
PER_NODE = 16_000.0  # bytes while a body is assembled, and of the rows that its ports have over all nodes
PROCESSES = 2  # each steps one of the scenarios with factors of its own
KEPT = 2  # factors per body, of two film coefficients (`twin.build.stepper`)
LARGE = 10_000  # nodes of a finer model of which each scenario takes its own process from the start


def refuse_lumped(machine: Machine) -> None:
    """Raises DescriptionError for a machine without a mesh."""
    if machine.lumped:
        remedy = "leave --mesh away; more `elements` of its bars are another discretisation"
        raise DescriptionError("a lumped machine has no mesh", "--mesh", remedy)


def mesh_part(
    machine: Machine,
    full: FullModel,
    scenarios: Sequence[Scenario],
    substeps: int,
    positions: np.ndarray,
    progress: Progress = silent,
    memory: float | None = None,
) -> Part:
    """The estimated error of the mesh as a part of the certificate, which does not count in its sums.

    positions (m, n_axes) m beside the poses of the grid. memory: bytes that may be used, by default the share of those
    free now that a factor may take. Raises DescriptionError as `assemble`.
    """
    refuse_lumped(machine)
    free = MEMORY_SHARE * available_memory() if memory is None else memory
    needed, unknowns = refined_bytes(full.bodies), refined_unknowns(full.bodies)
    finer = needed <= free and unknowns <= LARGEST
    coarse, places = _at_one_pose(full.thermal), np.vstack([full.thermal.poses, positions])
    one = {axis: (float(grid[0]),) for axis, grid in zip(coarse.pose_axes, full.thermal.pose_grid, strict=True)}
    alone = machine.model_copy(update={"poses": one})
    if finer:
        meshes = tuple(body_mesh(body.name, tuple(map(refined, body.parts))) for body in full.bodies)
        pair = (assemble_meshed(alone, meshes, progress).thermal, coarse)
        factor, between = OF_FINER, f"{OF_FINER:.2f} x the difference to a mesh of half the size"
    else:
        pair = (coarse, assemble_meshed(alone, full.bodies, progress, linear=True).thermal)
        why = f"{needed / 1e9:.2g} GB of memory, {free / 1e9:.2g} GB may be used"
        if unknowns > LARGEST:
            why = f"{unknowns / 1e6:.1f} million unknowns in a body"
        factor = OF_LINEAR
        between = f"indication: {factor:.2f} x the difference to linear elements, as half the size would take {why}"
    with progress("mesh against a finer one" if finer else "mesh against linear elements", len(scenarios)) as advance:
        at_once = 0.0 if pair[0].n > LARGE else LONG
        ways = [Way(model) for model in pair]
        (found,) = compare_ways(ways, [(0, 1)], scenarios, substeps, places, advance, at_once)
    return Part(MESH, between, _scaled(found, factor), counts=False)


def refined_bytes(bodies: Sequence[BodyMesh]) -> float:
    """Memory of the machine on a mesh of half the size: to condense its largest body, or to step all of them."""
    sizes = [_refined_nodes(body) for body in bodies]
    largest = max(sizes)
    elastic = predicted_bytes(3 * largest, 3 * largest * ELASTIC_ROW)
    thermal = sum(predicted_bytes(n, n * THERMAL_ROW) for n in sizes)
    return max(elastic, PROCESSES * KEPT * thermal) + PER_NODE * sum(sizes)


def refined_unknowns(bodies: Sequence[BodyMesh]) -> int:
    """Elastic unknowns of the largest body on a mesh of half the size."""
    return 3 * max(map(_refined_nodes, bodies))


def _refined_nodes(body: BodyMesh) -> int:
    return sum(map(refined_size, body.parts))


def _at_one_pose(model: MachineModel) -> MachineModel:
    """The model with the first pose of its grid only: positions are read through the structure, with fewer rows."""
    bodies = tuple(replace(body, G=body.G[:1]) for body in model.bodies)
    grid = tuple(nodes[:1] for nodes in model.pose_grid)
    return replace(model, bodies=bodies, poses=model.poses[:1], pose_grid=grid)


def _scaled(found: Comparison, factor: float) -> Comparison:
    """Errors times the factor, without the pose that the models have of their own.

    Displacements count from those at the reference temperature, zero on every mesh: a machine that stands warm all the
    time does not change, and is wrong by a share of what it has grown by.
    """
    return replace(
        found,
        temperature_error=factor * found.temperature_error,
        displacement_error=factor * found.displacement_error[:, 1:],
        displacement_low=np.minimum(found.displacement_low[:, 1:], 0.0),
        displacement_high=np.maximum(found.displacement_high[:, 1:], 0.0),
    )
