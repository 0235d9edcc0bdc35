"""Does the description fit its meshes? Sizes, surfaces, joints, guides, supports and sensors, all problems at once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from twin.build.encoder import scale_gaps
from twin.build.interface import interface
from twin.build.lumped import lumped_ports
from twin.build.lumped_body import count
from twin.build.mechanism import mechanisms
from twin.build.mesh import BodyMesh, PartMesh, body_mesh, load_part_mesh
from twin.build.part_size import size_problems, volume
from twin.build.ports import ContactPorts, contact_ports
from twin.build.surface import Patch, patch
from twin.errors import Problem, TwinError
from twin.machine.bodies import Body, bodies_of, body_of, split_surface
from twin.machine.check_lumped import total_capacity
from twin.machine.description import Machine
from twin.machine.kinematics import direction, linear_axes, moving_contacts
from twin.machine.surfaces import film_surfaces, unknown_surface

SENSOR_GAP = 5e-3  # m between a sensor and its part
PLANE_GAP = 1e-3  # m between the planes of a pad and its rail


@dataclass(frozen=True)
class MeshReport:
    """What was found, and what the meshes amount to."""

    problems: tuple[Problem, ...]
    parts: int
    bodies: int
    nodes: int  # P2 nodes: the temperatures of the full model
    mass: float  # kg, of parts
    capacity: float = 0.0  # J/K, of nodes and bars


def check_meshes(machine: Machine) -> MeshReport:
    """Read all meshes and check the description against them. Later checks wait for what they build on.

    Of a lumped machine there are no meshes: only the travel of what runs on its bars is checked.
    """
    if machine.lumped:
        return _check_lumped(machine)
    parts, problems = _load(machine)
    problems += [p for part in parts.values() for p in size_problems(machine, part)]
    if len(parts) == len(machine.parts):
        bodies = bodies_of(machine)
        meshes = tuple(body_mesh(b.name, tuple(parts[p] for p in b.parts)) for b in bodies)
        surfaces = _surfaces(machine, parts)
        problems += surfaces
        if not surfaces:
            problems += [*_fixed(machine, bodies, meshes), *_moving(machine, parts, meshes), *_scales(machine, meshes)]
        problems += _sensors(machine, parts)
        if machine.has_tcp:
            problems += [*_grounded(machine, bodies), *_driven(machine)]
            problems += [] if surfaces else _tcp(machine, bodies, parts)
            problems += [] if any(not p.warning for p in problems) else mechanisms(machine, meshes)
    return MeshReport(
        problems=tuple(dict.fromkeys(problems)),
        parts=len(machine.parts),
        bodies=len(bodies_of(machine)),
        nodes=sum(p.n for p in parts.values()),
        mass=sum(volume(p) * machine.materials[machine.parts[n].material].density for n, p in parts.items()),
    )


def _check_lumped(machine: Machine) -> MeshReport:
    return MeshReport(
        problems=tuple(_travel(machine, lumped_ports(machine))),
        parts=0,
        bodies=len(bodies_of(machine)),
        nodes=sum(count(machine, member) for member in machine.members) + len(machine.tanks),
        mass=0.0,
        capacity=total_capacity(machine),
    )


def _load(machine: Machine) -> tuple[dict[str, PartMesh], list[Problem]]:
    parts: dict[str, PartMesh] = {}
    problems: list[Problem] = []
    for name, part in machine.parts.items():
        try:
            parts[name] = load_part_mesh(name, part, machine.folder)
        except TwinError as e:
            problems += e.problems
    return parts, problems


def _surfaces(machine: Machine, parts: dict[str, PartMesh]) -> list[Problem]:
    """Names of surfaces that no mesh has, surfaces without heat exchange declared or with two."""
    known = {name: tuple(part.surfaces) for name, part in parts.items()}
    try:
        film_surfaces(machine, known)
        problems = []
    except TwinError as e:
        problems = list(e.problems)
    for where, surface in _other_uses(machine):
        part, name = split_surface(surface)
        if name not in known.get(part, ()):
            problems.append(unknown_surface(surface, where, known))
    return problems


def _other_uses(machine: Machine) -> Iterator[tuple[str, str]]:
    """(where, "part.surface") of all uses besides films, fixed contacts and adiabatic lists."""
    for name, contact in machine.contacts.items():
        for pair in contact.pairs:
            yield from ((f"contacts.{name}.pairs", surface) for surface in pair)
    for name, axis in machine.axes.items():
        for key in ("scale", "reader"):
            if surface := getattr(axis.encoder, key):
                yield f"axes.{name}.encoder.{key}", surface
    for name, source in machine.sources.items():
        if source.surface and source.surface not in machine.nodes:
            yield f"sources.{name}.surface", source.surface
    for name, tank in machine.tanks.items():
        yield f"tanks.{name}.surface", tank.surface
    for name, added in machine.scales.items():
        yield f"scales.{name}.surface", added.surface
    for name, support in machine.supports.items():
        yield f"supports.{name}.surface", support.surface
    if machine.has_tcp:
        yield "tcp.tool.surface", machine.tcp.tool.surface
        yield "tcp.work.surface", machine.tcp.work.surface


def _fixed(machine: Machine, bodies: tuple[Body, ...], meshes: tuple[BodyMesh, ...]) -> Iterator[Problem]:
    for name, contact in machine.contacts.items():
        if contact.kind != "fixed" or contact.surfaces is None:
            continue
        body = body_of(bodies, split_surface(contact.surfaces[0])[0])
        try:
            interface(meshes[bodies.index(body)], *contact.surfaces, where=f"contacts.{name}", gap=contact.gap)
        except TwinError as e:
            yield from e.problems


def _moving(machine: Machine, parts: dict[str, PartMesh], meshes: tuple[BodyMesh, ...]) -> Iterator[Problem]:
    try:
        ports = contact_ports(machine, meshes)
    except TwinError as e:
        yield from e.problems
        return
    yield from _travel(machine, ports)
    for name, contact in machine.contacts.items():
        if contact.kind == "moving" and contact.axis is not None and contact.stiffness.normal > 0:
            for rail, pad in contact.pairs:
                yield from _plane(rail, pad, direction(machine, contact.axis), f"contacts.{name}.pairs", parts)


def _scales(machine: Machine, meshes: tuple[BodyMesh, ...]) -> Iterator[Problem]:
    """Linear scales that are shorter than the stroke, fixed beside themselves, or far from their readers."""
    try:
        yield from scale_gaps(machine, meshes)
    except TwinError as e:
        yield from e.problems


def _travel(machine: Machine, ports: ContactPorts) -> Iterator[Problem]:
    """Pads must stay between the first and the last station of their rail: beyond them eq (1) has no second station."""
    axes = linear_axes(machine)
    for pair in ports.pairs:
        axis = axes[pair.axis]
        ends = [pair.station - p if pair.rail_moves else pair.station + p for p in machine.axes[axis].stroke]
        rail = ports.rails[pair.rail]
        first, last = rail.stations[0], rail.stations[-1]
        tolerance = 1e-6 * (last - first)
        beyond = max(first - min(ends), max(ends) - last)
        if beyond > tolerance:
            yield Problem(
                f"pad '{ports.names[pair.pad_port]}' runs {beyond * 1e3:.3g} mm beyond the end stations of rail"
                f" '{rail.name}' ({first:.4g} .. {last:.4g} m along axis '{axis}') within the stroke",
                f"contacts.{pair.contact}",
                f"stations are the centres of the {'elements' if machine.lumped else 'segments'}: use more of them, "
                "a longer rail, or a shorter stroke",
            )


def _plane(rail: str, pad: str, along: np.ndarray, where: str, parts: dict[str, PartMesh]) -> Iterator[Problem]:
    """A pad with normal stiffness must lie on its rail's plane, facing it, and the plane must contain the axis."""
    r, p = _patch(rail, parts), _patch(pad, parts)
    size_r, size_p = float(np.linalg.norm(r.normal)), float(np.linalg.norm(p.normal))
    if size_r < 0.9 or size_p < 0.9:
        curved = rail if size_r < 0.9 else pad
        yield Problem(
            f"'{curved}' is not flat, so its normal is not defined",
            where,
            "set stiffness.normal = 0, or name a flat face",
        )
        return
    normal = r.normal / size_r
    if abs(normal @ along) > 0.02:
        yield Problem(f"'{rail}' is not parallel to the axis", where, "check axes.*.direction and the surface's name")
    if normal @ p.normal > -0.95 * size_p:
        yield Problem(
            f"'{pad}' does not face '{rail}'",
            where,
            "name the pad's face that looks at the rail, and the rail's towards the pad",
        )
        return
    offset = p.centroid - r.centroid
    gap = float(offset @ normal)
    if abs(gap) > PLANE_GAP:
        yield Problem(
            f"'{pad}' lies {gap * 1e3:.3g} mm off the plane of '{rail}'",
            where,
            "move one of the parts: pads lie on their rails",
        )
    across = np.cross(normal, along)
    reach = np.sqrt(3.0 * (across @ r.second_moment @ across)) + np.sqrt(3.0 * (across @ p.second_moment @ across))
    if abs(offset @ across) > reach:
        yield Problem(
            f"'{pad}' lies {abs(offset @ across) * 1e3:.3g} mm beside '{rail}'",
            where,
            "pair the pad with the rail below it",
        )


def _patch(surface: str, parts: dict[str, PartMesh]) -> Patch:
    part, name = split_surface(surface)
    return patch(parts[part], parts[part].facets(name))


def _grounded(machine: Machine, bodies: tuple[Body, ...]) -> Iterator[Problem]:
    """Every body must reach the ground through supports and moving contacts."""
    stiffness = np.sum([s.stiffness for s in machine.supports.values()], axis=0)
    for component, k in zip("xyz", np.atleast_1d(stiffness), strict=False):
        if not k > 0:
            yield Problem(
                f"no support holds the machine along {component}", "supports", f"give a stiffness along {component}"
            )
    reached = {body_of(bodies, split_surface(s.surface)[0]).name for s in machine.supports.values()}
    joined = [(a, b) for _, a, b in moving_contacts(machine, bodies)]
    while new := {y for a, b in joined for x, y in ((a, b), (b, a)) if x in reached} - reached:
        reached |= new
    for body in bodies:
        if body.name not in reached:
            shown = ", ".join(body.parts[:6]) + (" ..." if len(body.parts) > 6 else "")
            yield Problem(f"parts {shown} are joined to nothing that stands on the ground", f"parts.{body.parts[0]}",
                          "join them by a fixed or moving contact, or support them")  # fmt: skip


def _driven(machine: Machine) -> Iterator[Problem]:
    for axis in linear_axes(machine):
        pairs = [c.stiffness for c in machine.contacts.values() if c.kind == "moving" and c.axis == axis]
        for key, what in (
            ("axial", "drives it (screw and nut)"),
            ("normal", "carries it"),
            ("lateral", "guides it sideways"),
        ):
            if pairs and not any(getattr(s, key) > 0 for s in pairs):
                yield Problem(
                    f"axis '{axis}': no contact {what}",
                    f"axes.{axis}",
                    f'give a contact of the axis stiffness = {{ {key} = "200 N/um" }}',
                )


def _sensors(machine: Machine, parts: dict[str, PartMesh]) -> Iterator[Problem]:
    for name, sensor in machine.sensors.items():
        if sensor.part is None or sensor.position is None:
            continue
        distance = distance_to_part(parts[sensor.part], np.asarray(sensor.position))
        if distance > SENSOR_GAP:
            near = min(parts, key=lambda p: distance_to_part(parts[p], np.asarray(sensor.position)))
            hint = f"; part '{near}' is there" if near != sensor.part else ""
            yield Problem(
                f"sensor '{name}' is {distance * 1e3:.3g} mm away from part '{sensor.part}'",
                f"sensors.{name}.position",
                f"positions are in m, machine coordinates, all axes at zero{hint}",
            )


def distance_to_part(part: PartMesh, point: np.ndarray) -> float:
    """Distance [m] of a point (3,) from a part, 0 inside it; faces taken as flat."""
    mesh = part.mesh
    corner = mesh.p[:, mesh.t[:4]]  # (3, 4, n)
    near = np.all((corner.min(axis=1) <= point[:, None]) & (point[:, None] <= corner.max(axis=1)), axis=0)
    for tetra in corner[:, :, near].transpose(2, 0, 1):
        weights = np.linalg.solve(tetra[:, 1:] - tetra[:, :1], point - tetra[:, 0])
        if weights.min() >= 0 and weights.sum() <= 1:
            return 0.0
    return _distance_to_triangles(point, mesh.p[:, mesh.facets[:3, mesh.boundary_facets()]].transpose(2, 1, 0))


def _distance_to_triangles(point: np.ndarray, triangles: np.ndarray) -> float:
    """Distance of a point from the nearest of triangles (n, 3 corners, 3): from its face, else from an edge."""
    a, ab, ac = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    normal = np.cross(ab, ac)
    square = np.einsum("ni,ni->n", normal, normal)
    lever = point - a
    u = np.einsum("ni,ni->n", np.cross(lever, ac), normal) / square
    v = np.einsum("ni,ni->n", np.cross(ab, lever), normal) / square
    over = (u >= 0) & (v >= 0) & (u + v <= 1)
    height = np.abs(np.einsum("ni,ni->n", lever, normal)) / np.sqrt(square)
    best = float(height[over].min()) if over.any() else np.inf
    for i in range(3):
        start, edge = triangles[:, i], triangles[:, (i + 1) % 3] - triangles[:, i]
        along = np.clip(np.einsum("ni,ni->n", point - start, edge) / np.einsum("ni,ni->n", edge, edge), 0.0, 1.0)
        best = min(best, float(np.linalg.norm(point - start - along[:, None] * edge, axis=1).min()))
    return best


def _tcp(machine: Machine, bodies: tuple[Body, ...], parts: dict[str, PartMesh]) -> Iterator[Problem]:
    sides = {side: getattr(machine.tcp, side).surface for side in ("tool", "work")}
    tool, work = (body_of(bodies, split_surface(s)[0]) for s in sides.values())
    if tool == work and len(bodies) > 1:
        yield Problem(
            f"tool and work are both on body '{tool.name}'",
            "tcp",
            "one side holds the tool, the other the workpiece",
            warning=True,
        )
    for side, surface in sides.items():
        p = _patch(surface, parts)
        distance = (
            float(np.linalg.norm(np.asarray(machine.tcp.tool.point) - p.centroid)) if machine.tcp.tool.point else 0.0
        )
        if side == "tool" and distance > 1.0:
            yield Problem(f"the tool centre point is {distance:.3g} m away from '{surface}'", "tcp.tool.point",
                          "it is given in machine coordinates, all axes at zero", warning=True)  # fmt: skip
        if np.linalg.eigvalsh(p.second_moment)[1] < 1e-8:
            yield Problem(
                f"'{surface}' is too narrow to read a tilt from",
                f"tcp.{side}.surface",
                "name a face of some millimetres",
            )
