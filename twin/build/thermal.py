"""The thermal model of a machine on quadratic tetrahedra, body by body, in the affine form of `twin.rom.model`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import scipy.sparse as sp
from skfem import BilinearForm
from skfem.helpers import dot, grad

from twin.build.film_area import film_matrix
from twin.build.free_nodes import with_free_nodes
from twin.build.interface import interface
from twin.build.mesh import BodyMesh, PartMesh
from twin.build.ports import ContactPorts, contact_ports, port_averages
from twin.build.probe import probe
from twin.build.raised import with_raised
from twin.build.surface import patch
from twin.build.tanks import with_tanks
from twin.build.terms import Term, columns, joint_term
from twin.build.wiring import load_model
from twin.errors import DescriptionError, Problem, TwinError
from twin.machine.bodies import split_surface
from twin.machine.description import Machine, Material
from twin.machine.free_nodes import free_nodes
from twin.machine.kinematics import linear_axes
from twin.machine.references import reference_problems
from twin.machine.surfaces import film_surfaces
from twin.rom.load_model import LoadModel
from twin.rom.model import AffineBody, MachineModel

DEFAULT_POSES = 5  # positions per linear axis

FilmSurfaces = Mapping[str, tuple[tuple[str, str], ...]]
FilmMatrices = dict[str, dict[str, sp.csr_array]]  # film -> body -> int N N^T dA [m^2] (n, n)


@BilinearForm
def _conduction(u: Any, v: Any, _: Any) -> Any:
    return dot(grad(u), grad(v))


@BilinearForm
def _capacity(u: Any, v: Any, _: Any) -> Any:
    return u * v


def assemble_thermal(machine: Machine, bodies: tuple[BodyMesh, ...]) -> MachineModel:
    """The full thermal model: sparse bodies (`load_body_meshes`), load wiring, sensors, pose grid; G stays empty.

    Raises DescriptionError with the problems of surfaces, contacts, laws, sensors and poses.
    """
    wrong = [p for p in reference_problems(machine) if not p.warning]  # none after load_machine
    if wrong:
        raise DescriptionError.collect(wrong)
    films = film_surfaces(machine, {part.name: tuple(part.surfaces) for body in bodies for part in body.parts})
    ports = contact_ports(machine, bodies)
    matrices = _film_matrices(machine, bodies, films)
    load = load_model(machine, ports, _film_areas(machine, matrices))
    rows = _sensor_rows(machine, bodies)
    meshed = [_body(machine, body, matrices, ports, load, rows[body.name]) for body in bodies]
    return machine_model(
        machine, load, tuple(with_free_nodes(machine, i == 0, body, load) for i, body in enumerate(meshed))
    )


def machine_model(machine: Machine, load: LoadModel, bodies: tuple[AffineBody, ...]) -> MachineModel:
    """Bodies and loads with the names of the sensors and the grid of poses."""
    environments = [e.name for e in load.environments]
    grid = pose_grid(machine)
    axes = np.meshgrid(*grid, indexing="ij")
    return MachineModel(
        name=machine.machine.name,
        bodies=with_raised(machine, bodies),
        load_model=load,
        reference_temperature=machine.machine.reference_temperature,
        sensors=_structural(machine),
        ambient_sensors=tuple(
            (name, environments.index(sensor.environment))
            for name, sensor in machine.sensors.items()
            if sensor.environment is not None
        ),
        pose_axes=linear_axes(machine),
        pose_grid=grid,
        poses=np.stack([a.ravel() for a in axes], axis=1) if grid else np.zeros((1, 0)),
    )


def part_matrices(part: PartMesh, material: Material) -> tuple[sp.csr_array, sp.csr_array]:
    """Capacity int rho c N N^T dV [J/K] and conduction int lambda grad N . grad N^T dV [W/K], both (n, n).

    In chunks of elements: scikit-fem keeps all shape functions at all points of a basis.
    """
    E, A0 = sp.csr_array((part.n, part.n)), sp.csr_array((part.n, part.n))
    for basis in part.chunks():
        E = E + sp.csr_array(_capacity.assemble(basis))
        A0 = A0 + sp.csr_array(_conduction.assemble(basis))
    return E * (material.density * material.heat_capacity), A0 * material.conductivity


def pose_grid(machine: Machine) -> tuple[np.ndarray, ...]:
    """Positions [m] per linear axis: the description's list, or so many over the stroke, ends included (5 by default).

    A single one lies in the middle of the stroke; a machine of parts without a TCP has no other.
    """
    grid = []
    still = not (machine.lumped or machine.has_tcp)
    for name in linear_axes(machine):
        wanted, (low, high) = 1 if still else machine.poses.get(name, DEFAULT_POSES), machine.axes[name].stroke
        if wanted == 1:
            grid.append(np.array([(low + high) / 2]))
        elif isinstance(wanted, int):
            grid.append(np.linspace(low, high, wanted))
        else:
            grid.append(np.asarray(wanted, dtype=float))
    return tuple(grid)


def _body(
    machine: Machine,
    body: BodyMesh,
    matrices: FilmMatrices,
    ports: ContactPorts,
    load: LoadModel,
    rows: Mapping[str, np.ndarray],
) -> AffineBody:
    parts = [part_matrices(part, machine.materials[machine.parts[part.name].material]) for part in body.parts]
    E = sp.csr_array(sp.block_diag([e for e, _ in parts], format="csr"))
    A0 = sp.csr_array(sp.block_diag([a for _, a in parts], format="csr"))
    one = np.ones(body.n)
    height = body.nodes[:, "xyz".index(machine.machine.vertical)]
    terms = [*_film_terms(body, matrices, load, height), *_joint_terms(machine, body, load)]
    B = _source_loads(machine, body, load)
    P, port_numbers = port_averages(body, ports)
    sensors = _structural(machine)
    graded = any(e.gradient for e in load.environments)
    bare = AffineBody(
        name=body.name,
        E=E,
        A0=A0,
        A=tuple(t.matrix for t in terms),
        theta=tuple(t.coefficient for t in terms),
        M=columns([t.area for t in terms], body.n),
        B=columns(list(B.values()), body.n),
        sources=tuple(B),
        P=P,
        ports=port_numbers,
        C=np.array(list(rows.values())) if rows else np.zeros((0, body.n)),
        sensors=tuple(sensors.index(name) for name in rows),
        G=np.zeros((0, 3, body.n)),
        one=one,
        energy=E @ one,
        H=columns([t.moment for t in terms], body.n) if terms and graded else None,
        members=tuple(part.name for part in body.parts),
        first=tuple(int(offset) for offset in body.offsets),
    )
    return with_tanks(machine, body, bare)


def _film_terms(body: BodyMesh, matrices: FilmMatrices, load: LoadModel, height: np.ndarray) -> Iterator[Term]:
    """height (n,) m of the nodes."""
    for k, film in enumerate(load.films):
        matrix = matrices[film.name].get(body.name)
        if matrix is not None:
            yield Term(k, matrix, matrix @ np.ones(body.n), matrix @ height)


def _joint_terms(machine: Machine, body: BodyMesh, load: LoadModel) -> Iterator[Term]:
    own = {part.name for part in body.parts}
    for j, joint in enumerate(load.joints):
        contact = machine.contacts[joint.name]
        if contact.surfaces is not None and split_surface(contact.surfaces[0])[0] in own:
            joined = interface(body, *contact.surfaces, where=f"contacts.{joint.name}", gap=contact.gap)
            yield joint_term(len(load.films) + j, joined.matrix)


def _source_loads(machine: Machine, body: BodyMesh, load: LoadModel) -> dict[int, np.ndarray]:
    """Number of a source on the body -> its heat of 1 W at the nodes, (n,)."""
    own = {part.name for part in body.parts}
    heated = {i: place for i, s in enumerate(load.sources) if (place := machine.sources[s.name].surface) is not None}
    return {
        i: _spread(body, surface)
        for i, surface in heated.items()
        if surface not in machine.nodes and split_surface(surface)[0] in own
    }


def _structural(machine: Machine) -> tuple[str, ...]:
    """Sensors on parts, not in the air."""
    return tuple(name for name, s in machine.sensors.items() if s.environment is None)


def _film_matrices(machine: Machine, bodies: tuple[BodyMesh, ...], films: FilmSurfaces) -> FilmMatrices:
    """Of every film, by the name of each body that it acts on."""
    found: FilmMatrices = {}
    for name, surfaces in films.items():
        parts, found[name] = {part for part, _ in surfaces}, {}
        for body in bodies:
            if parts & {part.name for part in body.parts}:
                found[name][body.name] = film_matrix(machine, body, surfaces, name, machine.films[name].additional)
    return found


def _film_areas(machine: Machine, matrices: FilmMatrices) -> dict[str, float]:
    """m^2 of what every film acts on."""
    nodes = free_nodes(machine)
    areas = {}
    for name, own in matrices.items():
        of_nodes = (float(nodes[s].area or 0.0) for s in machine.films[name].surfaces if s in nodes)
        areas[name] = sum(of_nodes) + sum(float(matrix.sum()) for matrix in own.values())
    return areas


def _spread(body: BodyMesh, surface: str) -> np.ndarray:
    """1 W spread evenly over "part.surface": (n,), sums to 1."""
    part_name, name = split_surface(surface)
    part, offset = body.part(part_name)
    found = patch(part, part.facets(name))
    spread = np.zeros(body.n)
    spread[offset + found.nodes] = found.mean
    return spread


def _sensor_rows(machine: Machine, bodies: tuple[BodyMesh, ...]) -> dict[str, dict[str, np.ndarray]]:
    """Per body, the interpolation row (n,) of each of its sensors; DescriptionError lists all that are misplaced."""
    rows: dict[str, dict[str, np.ndarray]] = {body.name: {} for body in bodies}
    problems: list[Problem] = []
    for name, sensor in machine.sensors.items():
        if sensor.part is None or sensor.position is None:
            continue
        body = next(b for b in bodies if any(p.name == sensor.part for p in b.parts))
        part, offset = body.part(sensor.part)
        try:
            nodes, weights = probe(part, np.array(sensor.position), f"sensors.{name}.position")
        except TwinError as e:
            problems += e.problems
            continue
        rows[body.name][name] = np.zeros(body.n)
        rows[body.name][name][offset + nodes] = weights
    if problems:
        raise DescriptionError.collect(problems)
    return rows
