"""Which surface exchanges heat through which film: every named surface is accounted for exactly once.

Additional films come on top of that: they account for no surface.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from twin.errors import DescriptionError, Problem
from twin.machine.bodies import split_surface
from twin.machine.description import Machine
from twin.nearest import did_you_mean


def film_surfaces(machine: Machine, surfaces: Mapping[str, Collection[str]]) -> dict[str, tuple[tuple[str, str], ...]]:
    """(part, surface) of every film, with "part.*" expanded to what no film, fixed contact or adiabatic list names.

    `surfaces` holds the named surfaces of every part's mesh. A fixed contact may share its surface with others; what
    they leave uncovered exchanges no heat. Raises DescriptionError with all unknown, unused and doubly used surfaces.
    """
    problems: list[Problem] = []
    uses: dict[tuple[str, str], list[str]] = {(p, s): [] for p, names in surfaces.items() for s in names}

    def claim(surface: str, use: str, where: str) -> tuple[str, str] | None:
        part, name = split_surface(surface)
        if (part, name) not in uses:
            problems.append(unknown_surface(surface, where, surfaces))
            return None
        if use and use not in uses[part, name]:
            uses[part, name].append(use)
        return part, name

    for part_name, part in machine.parts.items():
        for name in part.adiabatic:
            claim(f"{part_name}.{name}", "the adiabatic list", f"parts.{part_name}.adiabatic")
    for contact_name, contact in machine.contacts.items():
        for surface in contact.surfaces or ():
            claim(surface, "fixed contacts", f"contacts.{contact_name}.surfaces")
    result: dict[str, list[tuple[str, str]]] = {name: [] for name in machine.films}
    rest: dict[str, str] = {}  # part -> film that takes what is left of it
    for film_name, film in machine.films.items():
        where = f"films.{film_name}.surfaces"
        for surface in film.surfaces:
            part_name, name = split_surface(surface)
            if name != "*" or film.additional:
                key = claim(surface, "" if film.additional else f"films.{film_name}", where)
                if key and key not in result[film_name]:
                    result[film_name].append(key)
            elif part_name not in surfaces:
                problems.append(unknown_surface(surface, where, surfaces))
            elif rest.setdefault(part_name, film_name) != film_name:
                remedy = f"leave '{surface}' to one of them and name the surfaces of the other"
                problems.append(Problem(f"'{surface}' is also in films.{rest[part_name]}", where, remedy))
    for (part_name, name), users in uses.items():
        if not users and part_name in rest:
            result[rest[part_name]].append((part_name, name))
        elif len(users) != 1:
            problems.append(
                Problem(
                    f"surface '{part_name}.{name}' belongs to {' and '.join(users) or 'no film'}",
                    f"parts.{part_name}",
                    "put each surface into exactly one of: a film, a fixed contact, the part's adiabatic list",
                )
            )
    if problems:
        raise DescriptionError.collect(problems)
    return {name: tuple(found) for name, found in result.items()}


def unknown_surface(surface: str, where: str, surfaces: Mapping[str, Collection[str]]) -> Problem:
    """What to say about a "part.surface" that no mesh has."""
    part, name = split_surface(surface)
    if part not in surfaces:
        return Problem(f"unknown part in '{surface}'", where, did_you_mean(part, surfaces, "parts"))
    return Problem(f"unknown surface '{surface}'", where, did_you_mean(name, surfaces[part], f"surfaces of '{part}'"))
