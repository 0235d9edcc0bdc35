"""Every named surface of a machine made a place where something unknown may act.

A *place* is a surface with a source and a film of its own, both of zero strength: the description stays what it is, but
a basis that has seen them can answer what a watt, or a watt per square metre and kelvin, would do there. Surfaces that
a fixed contact joins without a gap are one place; the pads of a moving contact are one place, named by the contact.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from twin.build.full_model import FullModel
from twin.build.mesh import BodyMesh, PartMesh
from twin.build.probe import near
from twin.build.surface import mass, patch
from twin.machine.bodies import split_surface
from twin.machine.check_lumped import film_area
from twin.machine.description import Machine, Sensor
from twin.rom.load_model import EnvironmentWiring, Film, LawUse, Source
from twin.rom.model import AffineBody, MachineModel

PREFIX = "place:"  # no name of a description contains a colon
DISPLACED = "--aside"  # suffix of sensors moved aside
ASIDE = 0.008  # m
SHARES = (1.0, -1.0, 0.5, -0.5, 0.25, -0.25)  # of ASIDE that are tried: parts may be as small as a bearing block
WEAK, STRONG = 0.05, 20.0  # W/(m^2 K), of the film of a place: what bases are made for


@dataclass(frozen=True)
class Place:
    """Where something may act: a surface, the pads of a moving contact, or a node of a lumped machine."""

    name: str  # "bed.x_motor", "contacts.x_guide"
    members: tuple[str, ...]  # parts
    surfaces: tuple[tuple[str, str], ...]  # (part, surface); none of nodes
    film: str  # name of the film that the surface has, "" if none
    area: float  # m^2


def with_displaced_sensors(machine: Machine, bodies: Sequence[BodyMesh], seed: int = 5) -> Machine:
    """The description with a second sensor some millimetres beside each one on a part: what a wrong place would read.

    The other way, or nearer, where that would be off the part. Lumped machines have no places between nodes and stay as
    they are.
    """
    if machine.lumped:
        return machine
    parts = {part.name: part for body in bodies for part in body.parts}
    rng = np.random.default_rng(seed)
    sensors = dict(machine.sensors)
    for name, sensor in machine.sensors.items():
        if sensor.part is not None and sensor.position is not None:
            aside = rng.standard_normal(3)
            for share in SHARES:
                moved = np.asarray(sensor.position) + share * ASIDE * aside / np.linalg.norm(aside)
                if near(parts[sensor.part], moved):
                    position = (float(moved[0]), float(moved[1]), float(moved[2]))
                    sensors[name + DISPLACED] = Sensor(part=sensor.part, position=position)
                    break
    return machine.model_copy(update={"sensors": sensors})


def places_of(machine: Machine, full: FullModel) -> tuple[Place, ...]:
    """The places of a machine, in the order of its bodies."""
    film_of = _films(machine, full)
    if machine.lumped:
        return tuple(
            Place(
                member,
                (member,),
                (),
                film_of.get((member, ""), ""),
                _area(machine, member, film_of.get((member, ""), "")),
            )
            for body in full.thermal.bodies
            for member in body.members
            if not member.startswith("tanks.")
        )
    taken: dict[tuple[str, str], str] = {}  # surfaces that belong to a place of another name, or to none
    pads: dict[str, list[tuple[str, str]]] = {}
    for name, contact in machine.contacts.items():
        if contact.surfaces and contact.glues:
            taken[split_surface(contact.surfaces[1])] = ""
        for _, pad in contact.pairs:
            taken[split_surface(pad)] = f"contacts.{name}"
            pads.setdefault(f"contacts.{name}", []).append(split_surface(pad))
    found = []
    for body in full.bodies:
        for part in body.parts:
            for surface in part.surfaces:
                key = (part.name, surface)
                if key not in taken:
                    area = patch(part, part.facets(surface)).area
                    found.append(Place(".".join(key), (part.name,), (key,), film_of.get(key, ""), area))
    for name, keys in pads.items():
        area = sum(patch(_part(full, p), _part(full, p).facets(s)).area for p, s in keys)
        film = film_of.get(keys[0], "")
        found.append(Place(name, tuple(dict.fromkeys(p for p, _ in keys)), tuple(keys), film, area))
    return tuple(found)


def beside(places: Sequence[Place], own: int) -> list[int]:
    """Where heat described at a place might enter instead: elsewhere on its part; of nodes every other one."""
    members = set(places[own].members)
    return [p for p, place in enumerate(places) if p != own and (not place.surfaces or members & set(place.members))]


def _area(machine: Machine, member: str, film: str) -> float:
    """m^2 of a node or bar: of the film that it has, else all it has; one where the description does not say."""
    if film:
        return film_area(machine, machine.films[film], member)
    if member in machine.nodes:
        return machine.nodes[member].area or 1.0
    bar = machine.bars[member]
    return (bar.perimeter or 0.0) * bar.length or 1.0


def _part(full: FullModel, name: str) -> PartMesh:
    return next(part for body in full.bodies for part in body.parts if part.name == name)


def _films(machine: Machine, full: FullModel) -> dict[tuple[str, str], str]:
    """(part, surface) -> the film that the surface has; of lumped machines (node, "")."""
    if machine.lumped:
        return {
            (s, ""): name
            for name, film in reversed(machine.films.items())
            if not film.additional
            for s in film.surfaces
        }
    from twin.machine.surfaces import film_surfaces

    surfaces = {part.name: tuple(part.surfaces) for body in full.bodies for part in body.parts}
    own = {name: film for name, film in machine.films.items() if not getattr(film, "additional", False)}
    found = film_surfaces(machine.model_copy(update={"films": own}), surfaces)
    return {key: name for name, keys in found.items() for key in keys}


def with_places(full: FullModel, places: Sequence[Place]) -> MachineModel:
    """The thermal model with a source and a film of zero strength at every place."""
    model = full.thermal
    load = model.load_model
    n_films, n_sources, n_env, n = len(load.films), len(load.sources), len(load.environments), len(places)
    bodies = []
    for b, body in enumerate(model.bodies):
        A, M, B, own = [], [], [], []
        for k, place in enumerate(places):
            found = _on_body(full.bodies[b] if full.bodies else None, body, place)
            if found is not None:
                mean, matrix = found
                B.append(mean)
                A.append(matrix)
                M.append(matrix @ body.one)
                own.append(k)
        cut = sum(k < n_films for k in body.theta)
        extra = np.column_stack(M) if M else np.zeros((body.n, 0))
        none = np.zeros_like(extra)
        bodies.append(
            replace(
                body,
                A=(*body.A[:cut], *A, *body.A[cut:]),
                theta=(*body.theta[:cut], *(n_films + k for k in own), *(k + n for k in body.theta[cut:])),
                M=np.hstack([body.M[:, :cut], extra, body.M[:, cut:]]),
                H=None if body.H is None else np.hstack([body.H[:, :cut], none, body.H[:, cut:]]),
                raised=None
                if body.raised is None
                else np.array([np.hstack([r[:, :cut], none, r[:, cut:]]) for r in body.raised]),
                B=np.column_stack([body.B, *B]) if B else body.B,
                sources=(*body.sources, *(n_sources + k for k in own)),
            )
        )
    load = replace(
        load,
        environments=load.environments
        + tuple(EnvironmentWiring(PREFIX + p.name, "", model.reference_temperature) for p in places),
        sources=load.sources
        + tuple(Source(PREFIX + p.name, LawUse("constant_heat", {"power": 0.0}, {}), 1.0, "", 0.0) for p in places),
        films=load.films
        + tuple(
            Film(PREFIX + p.name, LawUse("constant_film", {"natural": 0.0}, {}), n_env + k, WEAK, STRONG)
            for k, p in enumerate(places)
        ),
    )
    return replace(model, bodies=tuple(bodies), load_model=load)


def _on_body(mesh: BodyMesh | None, body: AffineBody, place: Place) -> tuple[np.ndarray, sp.csr_array] | None:
    """1 W spread over the place (n,), and its mass matrix (n, n) [m^2]; None where it is on another body."""
    mean, total = np.zeros(body.n), 0.0
    if mesh is None:  # a node or bar: its states alike, weighted by capacity
        if place.name not in body.members:
            return None
        own = body.member_states(body.members.index(place.name))
        weight = body.E.diagonal()[own]
        mean[own] = weight / weight.sum()
        return mean, sp.csr_array(sp.diags_array(place.area * mean))
    blocks = {part.name: sp.csr_array((part.n, part.n)) for part in mesh.parts}
    for part_name, surface in place.surfaces:
        if part_name not in blocks:
            continue
        part, offset = mesh.part(part_name)
        facets = part.facets(surface)
        found = patch(part, facets)
        mean[offset + found.nodes] += found.mean * found.area
        total += found.area
        blocks[part_name] = blocks[part_name] + mass(part, facets)
    if total == 0.0:
        return None
    whole = sp.block_diag([blocks[part.name] for part in mesh.parts], format="csr")
    if whole.shape[0] < body.n:  # tanks come last
        whole.resize((body.n, body.n))
    return mean / total, sp.csr_array(whole)


def pruned(model: MachineModel, sources: Collection[str] = (), films: Collection[str] = ()) -> MachineModel:
    """The model of `with_places`, full or reduced, with the sources and films of these places only."""
    load = model.load_model
    source = _renumbered([s.name for s in load.sources], sources)
    film = _renumbered([f.name for f in load.films], films)
    air = _renumbered([e.name for e in load.environments], films)
    n_films = len(load.films)
    theta = film | {n_films + k: len(film) + k for k in range(len(load.joints))}
    bodies = tuple(_body_with(body, theta, source) for body in model.bodies)
    load = replace(
        load,
        sources=tuple(load.sources[k] for k in source),
        films=tuple(
            replace(load.films[k], environment=air[load.films[k].environment], radiant=air[load.films[k].radiant])
            for k in film
        ),
        environments=tuple(load.environments[k] for k in air),
    )
    return replace(model, bodies=bodies, load_model=load)


def _renumbered(names: Sequence[str], wanted: Collection[str]) -> dict[int, int]:
    """Old number -> new one, of those that are in the description or wanted."""
    kept = [k for k, n in enumerate(names) if not n.startswith(PREFIX) or n[len(PREFIX) :] in wanted]
    return {old: new for new, old in enumerate(kept)}


def _body_with(body: AffineBody, theta: Mapping[int, int], source: Mapping[int, int]) -> AffineBody:
    """A body with these films, joints and sources (old number -> new one) only."""
    terms = [i for i, k in enumerate(body.theta) if k in theta]
    own = [i for i, k in enumerate(body.sources) if k in source]
    return replace(
        body,
        A=tuple(body.A[i] for i in terms),
        theta=tuple(theta[body.theta[i]] for i in terms),
        M=body.M[:, terms],
        H=None if body.H is None else body.H[:, terms],
        raised=None if body.raised is None else body.raised[:, :, terms],
        B=body.B[:, own],
        B_out=None if body.B_out is None else body.B_out[:, own],
        sources=tuple(source[body.sources[i]] for i in own),
    )
