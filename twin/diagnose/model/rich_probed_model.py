"""The rich model of a machine that has seen heat and films at every named surface, made once per machine and cached."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from twin.build.cache import cached, machine_hash
from twin.build.full_model import FullModel, assemble, assemble_unrestricted
from twin.build.linear import from_vertices_and_tanks, linear_body
from twin.build.mesh import body_mesh, load_body_meshes
from twin.build.places import Place, places_of, with_displaced_sensors, with_places
from twin.build.project import project
from twin.build.refine import refined
from twin.build.rich_basis import RichOptions, rich_basis
from twin.build.scenario import theta_bounds
from twin.machine.description import Machine
from twin.progress import Progress, silent
from twin.rom.model import MachineModel

RICH = RichOptions(samples=10, tolerance=2e-2)
# without places only differences of two such models count, which err alike: of rails of five_axis in other segments, 14
# mK and 0.19 um rms, they are off by 0.7 mK and 0.02 um with 6 samples as with 10 (by a script, against 16 at 5e-3)
UNPROBED = RichOptions(samples=6, tolerance=2e-2)


class Mesh(Enum):
    """Of which elements the parts of a machine are made."""

    DESCRIBED = "as described"
    LINEAR = "the described tetrahedra with linear elements"
    FINER = "every tetrahedron in eight"


@dataclass(frozen=True)
class RichProbedModel:
    """The rich model of a machine with places and displaced copies of its sensors, cached."""

    rich: MachineModel
    places: tuple[Place, ...]
    height: tuple[np.ndarray, ...]  # per body (n, n_films of the description): A_k @ height [m^3]


def rich_probed_model(
    machine: Machine, progress: Progress = silent, mesh: Mesh = Mesh.DESCRIBED, probed: bool = True
) -> RichProbedModel:  # fmt: skip
    """The rich model with places, cached by description and meshes; mesh: lumped machines have that described alone.

    probed: False leaves out the places, for who asks what the described loads do.
    """
    linear = mesh is Mesh.LINEAR

    def make() -> RichProbedModel:
        if machine.lumped:
            full = assemble(machine, progress)
        else:
            meshes = load_body_meshes(machine)
            if mesh is Mesh.FINER:
                meshes = tuple(body_mesh(body.name, tuple(map(refined, body.parts))) for body in meshes)
            full = assemble_unrestricted(with_displaced_sensors(machine, meshes), meshes, progress, linear)
        places = places_of(machine, full) if probed else ()
        model = with_places(full, places)
        height = _heights(machine, full, model)
        if linear:
            pairs = list(zip(full.bodies, model.bodies, strict=True))
            V_of = [from_vertices_and_tanks(mesh, body.n) for mesh, body in pairs]
            height = [V.T @ h for V, h in zip(V_of, height, strict=True)]
            model = replace(model, bodies=tuple(linear_body(mesh, body) for mesh, body in pairs))
        if machine.lumped:
            bases = [np.diag(np.asarray(body.E.diagonal()) ** -0.5) for body in model.bodies]
        else:
            (low, high), options = theta_bounds(model.load_model), RICH if probed else UNPROBED
            with progress("rich basis", options.samples * len(model.bodies)) as advance:
                bases = [rich_basis(body, low, high, options, advance) for body in model.bodies]
        bodies, heights = [], []
        for body, V, h in zip(model.bodies, bases, height, strict=True):
            small = project(replace(body, F=None), V)
            bodies.append(replace(small, E=np.eye(small.n)))
            heights.append(V.T @ h)
        return RichProbedModel(replace(model, bodies=tuple(bodies)), places, tuple(heights))

    return cached("probed", __name__, (machine_hash(machine), mesh.name, probed), make)


def _heights(machine: Machine, full: FullModel, model: MachineModel) -> list[np.ndarray]:
    """Per body A_k @ height (n, n_films) of the description's films."""
    axis = "xyz".index(machine.machine.vertical)
    n_films = len(full.thermal.load_model.films)
    result = []
    for b, body in enumerate(model.bodies):
        H = np.zeros((body.n, n_films))
        if full.bodies:
            z = np.zeros(body.n)
            nodes = full.bodies[b].nodes[:, axis]
            z[: len(nodes)] = nodes
            for term, k in zip(body.A, body.theta, strict=True):
                if k < n_films:
                    H[:, k] = term @ z
        result.append(H)
    return result
