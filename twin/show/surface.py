"""The named surfaces of a machine: where they are, which film each has, and what of them exchanges no heat at all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from twin.build.film_area import ROUNDED
from twin.build.interface import common_areas
from twin.build.mesh import BodyMesh, load_body_meshes
from twin.build.surface import facet_nodes, patch
from twin.errors import Problem
from twin.machine.bodies import split_surface
from twin.machine.description import Machine
from twin.machine.surfaces import ADIABATIC, FIXED, surface_uses


@dataclass(frozen=True)
class NamedSurface:
    """A surface of a part, with what it is used for."""

    part: str
    name: str
    body: int  # number of its body
    area: float  # m^2
    joined: float  # m^2 of it within fixed contacts
    corners: np.ndarray  # (m, 3 corners, 3) m, of its facets; right-handed seen from outside
    bare: np.ndarray  # (m,) share of each facet that exchanges no heat: no film, no contact
    uses: tuple[str, ...]  # "films.NAME", "fixed contacts", "the adiabatic list"; one, where the description is right
    additional: tuple[str, ...]  # films on top
    contacts: tuple[str, ...]  # fixed and moving

    @property
    def path(self) -> str:
        return f"{self.part}.{self.name}"

    @property
    def film(self) -> str | None:
        """The film that accounts for it."""
        return next((use.removeprefix("films.") for use in self.uses if use.startswith("films.")), None)

    @property
    def of_film(self) -> float:
        """m^2 that its film acts on: all, or what fixed contacts leave free."""
        return self.area - self.joined if FIXED in self.uses else self.area

    @property
    def uncovered(self) -> float:
        """m^2 that exchange no heat."""
        facet = facet_areas(self.corners)
        share = float(facet @ self.bare / facet.sum())
        return self.area * share if share > ROUNDED else 0.0

    @property
    def why(self) -> str:
        """What leaves it uncovered, where something does."""
        if FIXED in self.uses:
            return "beside its fixed contacts"
        return "listed as adiabatic" if ADIABATIC in self.uses else "in no film, contact or adiabatic list"


@dataclass(frozen=True)
class Surfaces:
    """All named surfaces of a machine of parts."""

    bodies: tuple[str, ...]
    named: tuple[NamedSurface, ...]  # body by body
    films: Mapping[str, tuple[str, ...]]  # paths of each film's surfaces
    problems: tuple[Problem, ...]  # surfaces without a use or with two, names that no mesh has

    def numbers(self, *paths: str) -> list[int]:
        """Of surfaces by "part.surface"; unknown ones are left out, `problems` or `twin check` tell of them."""
        return [k for k, s in enumerate(self.named) if s.path in paths]


def named_surfaces(machine: Machine) -> Surfaces:
    """Read the meshes and account for every facet; nothing is assembled.

    Raises DescriptionError with the problems of all meshes.
    """
    meshes = load_body_meshes(machine)
    uses = surface_uses(machine, {part.name: tuple(part.surfaces) for body in meshes for part in body.parts})
    joined = _joined(machine, meshes)
    contacts = _contacts(machine)
    moving = {s for c in machine.contacts.values() for pair in c.pairs for s in pair}
    found = []
    for b, body in enumerate(meshes):
        for part in body.parts:
            for name, facets in part.surfaces.items():
                path, key = f"{part.name}.{name}", (part.name, name)
                films = [film for film, surfaces in uses.films.items() if key in surfaces]
                corners = part.nodes[facet_nodes(part, facets)[:, :3]]
                bare = np.zeros(len(facets))
                if not films and path not in moving:
                    bare = np.clip(1.0 - joined.get(path, bare) / facet_areas(corners), 0.0, 1.0)
                found.append(NamedSurface(
                    part.name, name, b, patch(part, facets).area, float(np.sum(joined.get(path, 0.0))), corners, bare,
                    uses.users[key],
                    tuple(f for f in films if machine.films[f].additional), tuple(contacts.get(path, ())),
                ))  # fmt: skip
    films_of = {film: tuple(f"{p}.{s}" for p, s in surfaces) for film, surfaces in uses.films.items()}
    return Surfaces(tuple(body.name for body in meshes), tuple(found), films_of, uses.problems)


def facet_areas(corners: np.ndarray) -> np.ndarray:
    """(m,) m^2 of triangles (m, 3, 3)."""
    edges = corners[:, 1:] - corners[:, :1]
    return np.asarray(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2.0)


def _joined(machine: Machine, meshes: tuple[BodyMesh, ...]) -> dict[str, np.ndarray]:
    """m^2 of every facet, within all fixed contacts of a surface."""
    found: dict[str, np.ndarray] = {}
    known = {f"{part.name}.{name}" for body in meshes for part in body.parts for name in part.surfaces}
    for contact in machine.contacts.values():
        if contact.surfaces is None or not known.issuperset(contact.surfaces):
            continue
        part = split_surface(contact.surfaces[0])[0]
        body = next(m for m in meshes if any(p.name == part for p in m.parts))
        for surface, area in zip(contact.surfaces, common_areas(body, *contact.surfaces, gap=contact.gap), strict=True):
            found[surface] = found.get(surface, 0.0) + area
    return found


def _contacts(machine: Machine) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for name, contact in machine.contacts.items():
        for surface in dict.fromkeys([*(contact.surfaces or ()), *(s for pair in contact.pairs for s in pair)]):
            found.setdefault(surface, []).append(name)
    return found
