"""Which surface exchanges heat through which film: every named surface is accounted for exactly once.

Additional films come on top of that: they account for no surface.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from twin.errors import DescriptionError, Problem
from twin.machine.bodies import split_surface
from twin.machine.description import Machine
from twin.machine.free_nodes import on_parts
from twin.nearest import did_you_mean

FIXED, ADIABATIC = "fixed contacts", "the adiabatic list"  # uses of a surface besides "films.NAME"


@dataclass(frozen=True)
class SurfaceUses:
    """What every named surface is used for, right or wrong."""

    films: Mapping[str, tuple[tuple[str, str], ...]]  # (part, surface) of every film, additional ones too
    # (part, surface) -> "films.NAME" and the above: one is right, or a film on what fixed contacts leave free
    users: Mapping[tuple[str, str], tuple[str, ...]]
    problems: tuple[Problem, ...]


def film_surfaces(machine: Machine, surfaces: Mapping[str, Collection[str]]) -> dict[str, tuple[tuple[str, str], ...]]:
    """(part, surface) of every film, with "part.*" expanded to what no film, fixed contact or adiabatic list names.

    `surfaces` holds the named surfaces of every part's mesh. A fixed contact may share its surface with others; what
    they leave free exchanges no heat, unless a film names the surface itself: it acts on that. Nodes beside parts are
    left out. Raises DescriptionError with all unknown, unused and doubly used surfaces.
    """
    uses = surface_uses(machine, surfaces)
    if uses.problems:
        raise DescriptionError.collect(list(uses.problems))
    return dict(uses.films)


def surface_uses(machine: Machine, surfaces: Mapping[str, Collection[str]]) -> SurfaceUses:
    """The same, with what each surface is used for; problems are told and not raised."""
    uses = _Uses(surfaces)
    for part_name, part in machine.parts.items():
        for name in part.adiabatic:
            uses.claim(f"{part_name}.{name}", ADIABATIC, f"parts.{part_name}.adiabatic")
    for contact_name, contact in machine.contacts.items():
        for surface in contact.surfaces or ():
            uses.claim(surface, FIXED, f"contacts.{contact_name}.surfaces")
    result: dict[str, list[tuple[str, str]]] = {name: [] for name in machine.films}
    rest: dict[str, str] = {}  # part -> film that takes what is left of it
    for film_name, film in machine.films.items():
        where = f"films.{film_name}.surfaces"
        for surface in on_parts(machine, film):
            part_name, name = split_surface(surface)
            if name == "*" and not film.additional:
                uses.claim_rest(rest, surface, film_name, where)
                continue
            key = uses.claim(surface, "" if film.additional else f"films.{film_name}", where)
            if key and key not in result[film_name]:
                result[film_name].append(key)
    for part_name, name in uses.left_to(rest):
        result[rest[part_name]].append((part_name, name))
    films = {name: tuple(found) for name, found in result.items()}
    return SurfaceUses(films, uses.users(rest), tuple(uses.problems))


class _Uses:
    """What every named surface is used for, and what is wrong with that."""

    def __init__(self, surfaces: Mapping[str, Collection[str]]) -> None:
        self._surfaces = surfaces
        self._users: dict[tuple[str, str], list[str]] = {(p, s): [] for p, names in surfaces.items() for s in names}
        self.problems: list[Problem] = []

    def claim(self, surface: str, use: str, where: str) -> tuple[str, str] | None:
        """(part, surface), now with a use more unless that is ""; None for one that no mesh has."""
        part, name = split_surface(surface)
        if (part, name) not in self._users:
            self.problems.append(unknown_surface(surface, where, self._surfaces))
            return None
        if use and use not in self._users[part, name]:
            self._users[part, name].append(use)
        return part, name

    def claim_rest(self, rest: dict[str, str], surface: str, film: str, where: str) -> None:
        """ "part.*" for a film: `rest` is part -> film, and one film has it."""
        part, _ = split_surface(surface)
        if part not in self._surfaces:
            self.problems.append(unknown_surface(surface, where, self._surfaces))
        elif rest.setdefault(part, film) != film:
            remedy = f"leave '{surface}' to one of them and name the surfaces of the other"
            self.problems.append(Problem(f"'{surface}' is also in films.{rest[part]}", where, remedy))

    def left_to(self, rest: Collection[str]) -> list[tuple[str, str]]:
        """Surfaces without a use, of the parts in `rest`; others must have one use."""
        left = []
        for (part, name), users in self._users.items():
            if not users and part in rest:
                left.append((part, name))
            elif len(users) != 1 and not (len(users) == 2 and FIXED in users and ADIABATIC not in users):
                what = f"surface '{part}.{name}' belongs to {' and '.join(users) or 'no film'}"
                remedy = "put each surface into exactly one of: a film, a fixed contact, the part's adiabatic list"
                self.problems.append(Problem(what, f"parts.{part}", remedy))
        return left

    def users(self, rest: Mapping[str, str]) -> dict[tuple[str, str], tuple[str, ...]]:
        """What each surface is used for; those without a use are of the film that takes the rest of their part."""
        return {
            (part, name): tuple(users) or ((f"films.{rest[part]}",) if part in rest else ())
            for (part, name), users in self._users.items()
        }


def unknown_surface(surface: str, where: str, surfaces: Mapping[str, Collection[str]]) -> Problem:
    """What to say about a "part.surface" that no mesh has."""
    part, name = split_surface(surface)
    if part not in surfaces:
        return Problem(f"unknown part in '{surface}'", where, did_you_mean(part, surfaces, "parts"))
    return Problem(f"unknown surface '{surface}'", where, did_you_mean(name, surfaces[part], f"surfaces of '{part}'"))
