"""Where an effect is written into a description: its surfaces, films, signals and switches, looked up by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from twin.errors import DescriptionError
from twin.machine import wiring
from twin.machine.bodies import owner_of
from twin.machine.description import BOX_SURFACES, Machine
from twin.machine.effects.effect import Effect, Window
from twin.nearest import did_you_mean


@dataclass(frozen=True)
class Change:
    """What one effect adds to a description and what it changes there."""

    tables: tuple[tuple[str, Mapping[str, object]], ...] = ()
    values: Mapping[str, float | str | bool | Sequence[str]] = field(default_factory=dict)
    signals: Mapping[str, tuple[Window, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class Site:
    """The description that an effect is written into, and the name of what it adds."""

    machine: Machine
    data: Mapping[str, Any]  # as written
    name: str


def film_at(machine: Machine, surface: str) -> str:
    """The film that a surface, node or bar has of its own: named, or by "part.*"; "" where it has none."""
    own = {name: film for name, film in machine.films.items() if not film.additional}
    for wanted in (surface, f"{owner_of(surface)}.*"):
        for name, film in own.items():
            if wanted in film.surfaces:
                return name
    return ""


def environment_at(machine: Machine, surface: str) -> str:
    """The environment of a surface: of its own film, else of another one of its part, else the machine's first."""
    if film := film_at(machine, surface):
        return machine.films[film].environment
    part = owner_of(surface)
    beside = [f.environment for f in machine.films.values() if part in map(owner_of, f.surfaces)]
    return next(iter([*beside, *machine.environment]))


def largest(machine: Machine, signal: str) -> float:
    """The largest size in the certified range of a signal, SI."""
    known = wiring.signal(signal, machine.signals[signal])
    return max(abs(known.low), abs(known.high))


def figure(value: float) -> float:
    """As many digits as a person would write."""
    return float(f"{value:.6g}")


def quantity(value: float, unit: str) -> str:
    return f"{value:.6g} {unit}"


def named(site: Site, place: str, *sections: str) -> tuple[str, str]:
    """(section, name) of a place like "films.bed". Raises DescriptionError unless it is one of the machine's."""
    section, _, name = place.partition(".")
    known = [f"{s}.{n}" for s in sections for n in getattr(site.machine, s)]
    if place not in known:
        raise DescriptionError(f"no such place: '{place}'", place, did_you_mean(place, known, "places"))
    return section, name


def surfaces_of(site: Site, place: str) -> tuple[str, ...]:
    """Of a place: a surface, node or bar itself, or the pads of a moving contact."""
    machine = site.machine
    moving = [f"contacts.{n}" for n, c in machine.contacts.items() if c.kind == "moving"]
    if place in moving:
        return tuple(dict.fromkeys(pad for _, pad in machine.contacts[place.partition(".")[2]].pairs))
    if owner_of(place) not in machine.members or ("." not in place and place in machine.parts):
        wanted = [f"{m}.{place.partition('.')[2] or '...'}" if m in machine.parts else m for m in machine.members]
        raise DescriptionError(f"no such surface: '{place}'", place, did_you_mean(place, [*wanted, *moving], "places"))
    part, _, surface = place.partition(".")
    if part in machine.parts and machine.parts[part].box is not None and surface not in BOX_SURFACES:
        known = [f"{part}.{s}" for s in BOX_SURFACES]
        remedy = did_you_mean(place, known, f"surfaces of '{part}'")
        raise DescriptionError(f"no such surface: '{place}'", place, remedy)
    return (place,)


def signal_of(site: Site, effect: Effect) -> tuple[str, str]:
    """(name, SI unit) of the signal that an effect follows."""
    if effect.signal not in site.machine.signals:
        what = f"unknown signal '{effect.signal}'" if effect.signal else "needs a signal"
        remedy = did_you_mean(effect.signal, site.machine.signals, "signals")
        raise DescriptionError(what, f"{effect.family} at {effect.place}", remedy)
    return effect.signal, wiring.signal(effect.signal, site.machine.signals[effect.signal]).unit


def switch_of(site: Site, effect: Effect) -> tuple[str, Change]:
    """The signal that switches an effect, and its declaration where it is a new one; "" for one that always acts."""
    if effect.signal:
        name, unit = signal_of(site, effect)
        if unit != "1":
            raise DescriptionError(f"signal '{name}' is no switch", effect.place, "name a signal of unit 1 in 0 .. 1")
        return name, Change()
    if not effect.windows:
        return "", Change()
    entry = {"unit": "1", "range": [0.0, 1.0], "default": 0.0}
    return site.name, Change(((f"signals.{site.name}", entry),), {}, {site.name: effect.windows})
