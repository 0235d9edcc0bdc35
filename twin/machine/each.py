"""Films with `each`: written out as one film per part or per surface, so that every law reads its own place.

A law that follows its surface reads the mean temperature of all surfaces of its film. With `each` the walls of a
column, the warm one and the cold one, have a film of their own each, with the same law in the same air. What comes out
is an ordinary description, so nothing after the loader knows `each`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from twin.errors import DescriptionError, Problem

PLACES = ("part", "surface")


def each_apart(films: Any) -> tuple[Any, dict[str, str]]:
    """[films] with each film that has a sound `each` written out, and the film that every one so made comes from.

    "room" becomes "room_bed" and "room_column", or "room_bed_x_min" .. of surfaces. What the types refuse stays as it
    is. Raises DescriptionError for names that there are already, and "part.*" where each surface has a film.
    """
    if not isinstance(films, dict):
        return films, {}
    made: dict[str, Any] = {}
    origins: dict[str, str] = {}
    problems: list[Problem] = []
    for name, film in films.items():
        places = _places(name, film)
        if places is None:
            made[name] = film
            continue
        where = f"films.{name}"
        if film["each"] == "surface":
            problems += [
                Problem(f"'{surface}' does not say which surfaces each have a film", f"{where}.surfaces", _REMEDY)
                for surface in film["surfaces"]
                if surface.endswith(".*")
            ]
        rest = {key: value for key, value in film.items() if key != "each"}
        for own, surfaces in places.items():
            if own in films or own in made:
                problems.append(Problem(f"makes films.{own}, which there is already", where, "rename one of them"))
            made[own], origins[own] = {**rest, "surfaces": surfaces}, name
    if problems:
        raise DescriptionError.collect(problems)
    return made, origins


_REMEDY = 'name them one by one, or write each = "part"'


def _places(name: str, film: Any) -> Mapping[str, list[str]] | None:
    """Name of a film -> its surfaces; None for a film without `each`, or one that the types refuse."""
    surfaces = film.get("surfaces") if isinstance(film, dict) else None
    if not isinstance(surfaces, list) or film.get("each") not in PLACES:
        return None
    if not all(isinstance(surface, str) for surface in surfaces) or not surfaces:
        return None
    places: dict[str, list[str]] = {}
    for surface in surfaces:
        place = surface.partition(".")[0] if film["each"] == "part" else surface.replace(".", "_")
        places.setdefault(f"{name}_{place}", []).append(surface)
    return places
