"""Effects in what a machine exchanges: films, joints, air, media, capacities behind a conductance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from twin.errors import DescriptionError
from twin.machine.bodies import owner_of
from twin.machine.effects.effect import Effect
from twin.machine.effects.site import (
    Change,
    Site,
    environment_at,
    figure,
    film_at,
    named,
    quantity,
    signal_of,
    surfaces_of,
    switch_of,
)
from twin.nearest import did_you_mean

TANK_TIME = 3600.0  # s: time constant of a tank whose conductance is not known


def film_gain(site: Site, effect: Effect) -> Change:
    """A film is stronger or weaker than declared, or its surface has more than it."""
    if effect.place.startswith("films."):
        _, name = named(site, effect.place, "films")
        return Change(values={f"films.{name}.gain": site.machine.films[name].gain * effect.amplitude})
    law, change = _film(site, effect)
    return replace(change, tables=(_additional(site, effect, law), *change.tables))


def forced_convection(site: Site, effect: Effect) -> Change:
    """A surface has wind that follows a speed."""
    name, unit = signal_of(site, effect)
    if unit == "1/s":  # rotating_cylinder reads such speeds, but its coefficient and exponent are fixed by a diameter
        what = f"no film law has a coefficient of its own that follows a speed of rotation, and '{name}' is in 1/s"
        remedy = "log pi D n as a signal in m/s and name that, or write a film of law rotating_cylinder by hand"
        raise DescriptionError(what, effect.place, f"{remedy}: docs/hiding.md")
    if unit != "m/s":
        raise DescriptionError(f"signal '{name}' is in {unit}", effect.place, "name a speed in m/s")
    parameters = {
        "natural": 0.0, "forced": quantity(effect.amplitude, "W/(m^2*K)"), "exponent": effect.exponent,
    }  # fmt: skip
    return Change(
        (_additional(site, effect, {"law": "forced_film", "parameters": parameters, "signals": {"speed": name}}),)
    )


def coolant(site: Site, effect: Effect) -> Change:
    """A medium of another temperature flows over a surface."""
    if "temperature" not in effect.settings:
        raise DescriptionError("needs the temperature of the medium", f"coolant at {effect.place}", "give it in degC")
    law, change = _film(site, effect)
    medium = (f"environment.{site.name}", {"temperature": f"{float(effect.settings['temperature']):.6g} degC"})
    return replace(change, tables=(_additional(site, effect, law, site.name), medium, *change.tables))


def joint(site: Site, effect: Effect) -> Change:
    """A joint conducts otherwise than declared, always or while something is on."""
    _, name = named(site, effect.place, "contacts")
    contact = site.machine.contacts[name]
    switch, change = switch_of(site, effect)
    if switch:
        _expect_no_switch(contact.switch, effect.place)
        return replace(
            change, values={f"contacts.{name}.switch": switch, f"contacts.{name}.switched": figure(effect.amplitude)}
        )
    if contact.total is not None:
        return Change(values={f"contacts.{name}.total": contact.total * effect.amplitude})
    if contact.joint is not None:
        return Change(values={f"contacts.{name}.joint.gain": contact.joint.gain * effect.amplitude})
    return Change(values={f"contacts.{name}.conductance": float(contact.conductance or 0.0) * effect.amplitude})


def missing_joint(site: Site, effect: Effect) -> Change:
    """Two nodes exchange heat that no contact joins; one that an axis moves against the other the description
    refuses."""
    ends = effect.place.split("<>")
    if len(ends) != 2:
        raise DescriptionError("needs two places", effect.place, "write both, as 'motor<>bed'")
    for end in ends:
        if owner_of(*surfaces_of(site, end)) in site.machine.parts:
            what = "no contact joins surfaces of two parts that do not touch"
            raise DescriptionError(what, effect.place, "name two nodes of a lumped machine")
    for name, contact in site.machine.contacts.items():
        if any(set(ends) == set(map(owner_of, pair)) for pair in (contact.surfaces or (), *contact.pairs)):
            remedy = f"change it: joint at contacts.{name}"
            raise DescriptionError(f"contacts.{name} joins them already", effect.place, remedy)
    joint = {"kind": "fixed", "surfaces": ends, "total": quantity(effect.amplitude, "W/K")}
    return Change(((f"contacts.{site.name}", joint),))


def zone(site: Site, effect: Effect) -> Change:
    """Air is not as it is measured: elsewhere, higher up, or while a door is open."""
    if effect.place.startswith("films."):
        return _own_air(site, effect)
    _, name = named(site, effect.place, "environment")
    entry, path = site.machine.environment[name], f"environment.{name}"
    switch, change = switch_of(site, effect)
    if effect.unit == "K/m":
        if switch:
            raise DescriptionError("a gradient has no switch", effect.place, "give it without windows")
        height = (
            {f"{path}.height": quantity(float(effect.settings["height"]), "m")} if "height" in effect.settings else {}
        )
        return Change(values={**height, f"{path}.gradient": quantity(entry.gradient + effect.amplitude, "K/m")})
    if switch:
        _expect_no_switch(entry.switch, effect.place)
        switched = quantity(effect.amplitude, "K")
        return replace(change, values={f"{path}.switch": switch, f"{path}.switched_offset": switched})
    return Change(values={f"{path}.offset": entry.offset + effect.amplitude})


def _own_air(site: Site, effect: Effect) -> Change:
    """One film has air of its own: a copy of its environment, warmer or colder."""
    _, name = named(site, effect.place, "films")
    if effect.unit == "K/m":
        remedy = f"name environment.{site.machine.films[name].environment}, or give a size in K"
        raise DescriptionError("a gradient belongs to an environment, not to one film", effect.place, remedy)
    entry = dict(site.data["environment"][site.machine.films[name].environment])
    switch, change = switch_of(site, effect)
    if switch:
        _expect_no_switch(site.machine.environment[site.machine.films[name].environment].switch, effect.place)
        entry |= {"switch": switch, "switched_offset": quantity(effect.amplitude, "K")}
    else:
        described = site.machine.environment[site.machine.films[name].environment]
        entry["offset"] = quantity(described.offset + effect.amplitude, "K")
    tables = ((f"environment.{site.name}", entry), *change.tables)
    return replace(change, tables=tables, values={f"films.{name}.environment": site.name})


def capacity(site: Site, effect: Effect) -> Change:
    """Something heavy hangs on a surface; as a factor, a node, tank or material stores otherwise than declared."""
    if effect.unit == "1":
        machine = site.machine
        own = {n: (f"nodes.{n}.capacity", v.capacity) for n, v in machine.nodes.items() if v.capacity is not None}
        own |= {f"tanks.{n}": (f"tanks.{n}.capacity", v.capacity) for n, v in machine.tanks.items()}
        own |= {
            f"materials.{n}": (f"materials.{n}.heat_capacity", v.heat_capacity) for n, v in machine.materials.items()
        }
        if effect.place not in own:
            remedy = f"{did_you_mean(effect.place, own, 'places with a capacity')}; or give a size in J/K"
            raise DescriptionError(f"'{effect.place}' declares no capacity", effect.place, remedy)
        path, declared = own[effect.place]
        return Change(values={path: declared * effect.amplitude})
    (surface, *_) = surfaces_of(site, effect.place)
    conductance = float(effect.settings.get("conductance", effect.amplitude / TANK_TIME))
    entry = {
        "surface": surface, "capacity": quantity(effect.amplitude, "J/K"), "conductance": quantity(conductance, "W/K"),
    }  # fmt: skip
    return Change(((f"tanks.{site.name}", entry),))


def _film(site: Site, effect: Effect) -> tuple[dict[str, object], Change]:
    """Law, parameters and signals of a film that is always there, or switched."""
    switch, change = switch_of(site, effect)
    natural = {"natural": quantity(effect.amplitude, "W/(m^2*K)")}
    if switch:
        return {"law": "switched_film", "parameters": natural, "signals": {"switch": switch}}, change
    return {"law": "constant_film", "parameters": natural}, change


def _expect_no_switch(switch: str | None, place: str) -> None:
    if switch is not None:
        remedy = "one entry has one switch: let its signal tell both histories"
        raise DescriptionError(f"is switched by '{switch}' already", place, remedy)


def _additional(site: Site, effect: Effect, law: Mapping[str, object], environment: str = "") -> tuple[str, Mapping]:
    """An additional film at the place of an effect, to the environment of its own film."""
    given = str(effect.settings.get("surfaces", ""))  # of a film: the description may say "part.*" only
    surfaces = tuple(given.split(",")) if given else surfaces_of(site, effect.place)
    machine = site.machine
    entry: dict[str, object] = {
        "law": law["law"],
        "surfaces": list(surfaces),
        "environment": environment or environment_at(machine, surfaces[0]),
        "additional": True,
    }
    own, node = machine.films.get(film_at(machine, surfaces[0])), machine.nodes.get(surfaces[0])
    if node is not None and node.area is None and own is not None and own.area is not None:
        entry["area"] = own.area
    return f"films.{site.name}", {**entry, **{k: v for k, v in law.items() if k != "law"}}
