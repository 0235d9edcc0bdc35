"""What is listed beside the machine: every named thing with its facts and the places to highlight."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from twin.machine.bodies import owner_of
from twin.machine.description import Machine
from twin.machine.explain import Explanation, Load, explain, load_of
from twin.machine.surfaces import FIXED
from twin.show.surface import NamedSurface, Surfaces

Facts = list[tuple[str, str]]


@dataclass(frozen=True)
class Entry:
    """One thing of the list."""

    group: str
    path: str  # "films.bed", "bed.top", "sensors.spindle"
    facts: Facts
    places: tuple[str, ...] = ()  # surfaces "part.surface", or nodes and bars
    point: tuple[float, float, float] | None = None  # m, machine coordinates, axes at zero
    on: str = ""  # the part that carries the point
    title: str = ""

    @property
    def name(self) -> str:
        return self.title or self.path.partition(".")[2]


def entries(machine: Machine, surfaces: Surfaces | None) -> list[Entry]:
    """All entries; surfaces: None of a lumped machine. Raises DescriptionError for a law that lacks something."""
    load = load_of(machine, {})
    found = [*_films(machine, surfaces, load), *_sources(machine, load), *_sensors(machine)]
    if surfaces is not None:
        found += [_surface(machine, s) for s in surfaces.named]
    found += [*_members(machine), *_contacts(machine, surfaces, load), *_held(machine, surfaces)]
    return found


def number(value: float, unit: str) -> str:
    """With its unit, "1" for none; four digits."""
    return f"{value:.4g}" + ("" if unit == "1" else f" {unit}")


def square(area: float) -> str:
    """An area [m^2] in words."""
    return f"{area:.3g} m²"


def _films(machine: Machine, surfaces: Surfaces | None, load: Load) -> Iterator[Entry]:
    for name, film in machine.films.items():
        on = surfaces.films[name] if surfaces else film.surfaces
        nodes = [s for s in film.surfaces if s in machine.nodes]
        facts: Facts = [("environment", _air(machine, film.environment))]
        if film.radiant:
            facts.append(("radiates to", _air(machine, film.radiant)))
        if surfaces:
            own = [s for s in surfaces.named if s.path in on]
            area = sum(s.area if film.additional else s.of_film for s in own)
            area += sum(float(machine.nodes[n].area or 0.0) for n in nodes)
            facts.append(("area", square(area)))
        elif film.area is not None:
            facts.append(("area", square(film.area)))
        facts.append(("described for", ", ".join(film.surfaces)))
        if surfaces:
            facts.append(("acts on", ", ".join([*on, *nodes]) or "nothing"))
        if film.additional:
            facts.append(("additional", "on top of what its surfaces exchange already"))
        facts += _law(explain(machine, f"films.{name}", load))
        yield Entry("Films", f"films.{name}", facts, (*on, *nodes))


def _sources(machine: Machine, load: Load) -> Iterator[Entry]:
    for name, source in machine.sources.items():
        one = explain(machine, f"sources.{name}", load)
        places: tuple[str, ...] = (source.surface,) if source.surface else ()
        if source.contact:
            pairs = machine.contacts[source.contact].pairs
            places = tuple(dict.fromkeys(s for pair in pairs for s in pair))
        yield Entry("Sources", f"sources.{name}", [("heats", one.place), *_law(one)], places)


def _sensors(machine: Machine) -> Iterator[Entry]:
    for name, sensor in machine.sensors.items():
        if sensor.part is None:
            air = sensor.environment or ""
            yield Entry("Sensors", f"sensors.{name}", [("in the air", _air(machine, air))])
            continue
        facts = [("on", sensor.part)]
        if sensor.position is not None:
            facts.append(("position", _point(sensor.position)))
        places = () if sensor.part in machine.parts else (sensor.part,)
        yield Entry("Sensors", f"sensors.{name}", facts, places, sensor.position, sensor.part)


def _surface(machine: Machine, s: NamedSurface) -> Entry:
    facts: Facts = [("part", f"{s.part}, of {machine.parts[s.part].material}"), ("area", square(s.area))]
    facts.append(("film", _film_words(machine, s)))
    if s.film:
        facts.append(("environment", _air(machine, machine.films[s.film].environment)))
    facts += [("additional film", name) for name in s.additional]
    for name in s.contacts:
        facts.append((f"{machine.contacts[name].kind} contact", f"{name}: {_role(machine, name, s.path)}"))
    facts += [("source", n) for n, source in machine.sources.items() if source.surface == s.path]
    facts += [("support", n) for n, support in machine.supports.items() if support.surface == s.path]
    facts += [("tank", n) for n, tank in machine.tanks.items() if tank.surface == s.path]
    if s.uncovered:
        facts.append(("uncovered", f"{square(s.uncovered)}, adiabatic: {s.why}"))
    return Entry("Surfaces", s.path, facts, (s.path,), title=s.path)


def _film_words(machine: Machine, s: NamedSurface) -> str:
    """Which film a surface has, and by which rule."""
    rest = next((n for n, f in machine.films.items() if f"{s.part}.*" in f.surfaces), None)
    if s.film is None:
        return "none" + (f": {s.part}.* of films.{rest} takes only what nothing else names" if rest else "")
    moving = any(machine.contacts[c].kind == "moving" for c in s.contacts)
    if FIXED in s.uses:
        return f"{s.film}, which names it: on {square(s.of_film)} that its fixed contacts leave free"
    below = "; it acts on all of the surface, under the pads, too" if moving else ""
    if s.path not in machine.films[s.film].surfaces:
        return f"{s.film}, by {s.part}.*: nothing else names this surface{below}"
    wins = f" and so wins over {s.part}.* of films.{rest}" if rest and rest != s.film else ""
    return f"{s.film}, which names it{wins}{below}"


def _role(machine: Machine, contact: str, path: str) -> str:
    entry = machine.contacts[contact]
    if entry.surfaces is not None:
        return "with " + ", ".join(s for s in entry.surfaces if s != path)
    rail = [pad for other, pad in entry.pairs if other == path]
    return f"rail of {', '.join(rail)}" if rail else f"pad on {', '.join(r for r, pad in entry.pairs if pad == path)}"


def _members(machine: Machine) -> Iterator[Entry]:
    for name, node in machine.nodes.items():
        given = [(key, getattr(node, key), unit) for key, unit in _NODE]
        facts = [(key, number(value, unit)) for key, value, unit in given if value is not None]
        yield Entry(
            "Nodes", f"nodes.{name}", [*facts, *([("material", node.material)] if node.material else [])], (name,)
        )
    for name, bar in machine.bars.items():
        facts = [("material", bar.material), ("length", number(bar.length, "m")), ("elements", str(bar.elements))]
        facts.append(("cross-section", number(bar.cross_section, "m²")))
        if bar.perimeter is not None:
            facts.append(("perimeter", number(bar.perimeter, "m")))
        yield Entry("Bars", f"bars.{name}", facts, (name,))


_NODE = (("capacity", "J/K"), ("volume", "m³"), ("mass", "kg"), ("area", "m²"))


def _contacts(machine: Machine, surfaces: Surfaces | None, load: Load) -> Iterator[Entry]:
    area = {s.path: s.area for s in surfaces.named} if surfaces else {}
    for name, contact in machine.contacts.items():
        law = _law(explain(machine, f"contacts.{name}", load))
        places = contact.surfaces or tuple(dict.fromkeys(s for pair in contact.pairs for s in pair))
        if contact.kind == "fixed":
            facts = [("joins", " and ".join(places)), *_areas(area, places)]
            if contact.gap is not None:
                facts.append(("gap", number(contact.gap, "m")))
            yield Entry("Fixed contacts", f"contacts.{name}", facts + law, tuple(places))
            continue
        facts = [("axis", str(contact.axis)), ("pairs", str(len(contact.pairs)))]
        facts += [] if machine.lumped else [("segments", str(contact.segments))]
        stiffness = [(k, getattr(contact.stiffness, k)) for k in ("axial", "normal", "lateral")]
        facts += [(f"stiffness {k}", f"{1e-6 * v:.4g} N/µm per pair") for k, v in stiffness if v]
        yield Entry("Moving contacts", f"contacts.{name}", facts + law, tuple(places))
        for group, side, others in (("Rails", 0, "pads"), ("Pads", 1, "on")):
            for place in dict.fromkeys(pair[side] for pair in contact.pairs):
                opposite = ", ".join(pair[1 - side] for pair in contact.pairs if pair[side] == place)
                told = [("contact", name), (others, opposite), *_areas(area, [place])]
                yield Entry(group, f"contacts.{name}.{place}", told, (place,), title=place)


def _areas(area: dict[str, float], places: Iterable[str]) -> Facts:
    return [(f"area of {p}", square(area[p])) for p in places if p in area]


def _held(machine: Machine, surfaces: Surfaces | None) -> Iterator[Entry]:
    for name, support in machine.supports.items():
        facts = [(f"stiffness {c}", f"{1e-6 * k:.4g} N/µm") for c, k in zip("xyz", support.stiffness, strict=True)]
        yield Entry("Supports", f"supports.{name}", [("holds", support.surface), *facts], (support.surface,))
    if machine.has_tcp and surfaces is not None:
        for side in ("tool", "work"):
            given = getattr(machine.tcp, side)
            told: Facts = [("surface", given.surface)]
            told += [("tool centre point", _point(given.point))] if given.point else []
            yield Entry("Tool and work", f"tcp.{side}", told, (given.surface,), given.point, owner_of(given.surface))
    for name, tank in machine.tanks.items():
        told = [
            ("on", tank.surface),
            ("capacity", number(tank.capacity, "J/K")),
            ("conductance", number(tank.conductance, "W/K")),
        ]
        yield Entry("Tanks", f"tanks.{name}", told, (tank.surface,))


def _air(machine: Machine, name: str) -> str:
    air = machine.environment[name]
    told = f"signal {air.signal}" if air.signal else f"{air.temperature:g} °C"
    return f"{name} ({told}" + (f", {air.gradient:g} K/m upwards)" if air.gradient else ")")


def _point(point: tuple[float, float, float]) -> str:
    return "x {:.4g}, y {:.4g}, z {:.4g} m".format(*point)


def _law(one: Explanation) -> Facts:
    """Law, formula, every argument with its unit, and what comes of it at the upper bound of every signal."""
    facts = [("law", one.law), ("formula", one.formula), ("from", one.citation)] if one.law else []
    for given in one.inputs:
        facts.append((given.name, f"{number(float(given.value[0]), given.unit)}: {given.meaning}; {given.origin}"))
    if one.law:
        facts.append(("at the upper bounds", number(float(one.value[0]), one.unit)))
    if one.radiation is not None and one.radiation.any():
        facts.append(("radiation besides", number(float(one.radiation[0]), one.unit)))
    return facts
