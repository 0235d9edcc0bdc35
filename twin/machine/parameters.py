"""What measurements may correct in a machine: the parameters of its description, with priors and bounds.

A parameter is there by default where the reduced model depends on it affinely; `[[parameters]]` tables say how well it
is known, or that it is not to be touched. The defaults are how well a designer knows such a number before anything has
been measured: films and joints are correlations, losses come from catalogues, materials from tables.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

from twin.errors import DescriptionError, Problem, TwinError
from twin.machine import wiring
from twin.machine.bodies import TANKS, owner_of
from twin.machine.check_lumped import GROWTH
from twin.machine.description import Machine, ParameterEntry
from twin.nearest import did_you_mean
from twin.rom.parameter import Kind, Parameter
from twin.units import to_si

# Relative tolerances (one standard deviation) and factors of the bounds around the nominal value
GAIN_OF_SOURCE, GAIN_OF_FILM, CONDUCTANCE = 0.25, 0.30, 0.40
HEAT_CAPACITY, NODE_CAPACITY, EXPANSION = 0.05, 0.20, 0.03
WIDE, NARROW, EXPANSION_BOUND = 5.0, 1.5, 1.2
OFFSET, OFFSET_BOUND = 0.5, 3.0  # K
TCP_EXPANSION = 0.30  # of the largest component of the same node or bar
TCP_BOUND = 10.0  # standard deviations
UNKNOWN = 5.0  # a relative tolerance above 500 % is a slip: 30 for "30 %"


def parameters(machine: Machine) -> tuple[Parameter, ...]:
    """The parameters that a calibration of the machine may fit, nominal values [SI] those of the description.

    In the order of sections (materials, nodes, contacts, tanks, environment, sources, films, tcp) and of the
    description within them. Left out: what is `fixed`, scale parameters whose nominal value is zero, environments of
    constant temperature unless a table names them, and what nothing depends on.
    Raises DescriptionError with all problems of the `[[parameters]]` tables.
    """
    declared, problems = _declared(machine)
    if problems:
        raise DescriptionError.collect(problems)
    return tuple(d.parameter for d in declared if d.fitted)


def parameter_units(machine: Machine) -> dict[str, str]:
    """Dotted paths of everything that may be declared a parameter, fitted or not, with their SI units."""
    return {d.parameter.path: d.parameter.unit for d in _every(machine)}


def parameter_problems(machine: Machine) -> list[Problem]:
    """What is wrong with the `[[parameters]]` tables of a description that is sound otherwise."""
    return _declared(machine)[1]


@dataclass(frozen=True)
class _Declared:
    """A parameter that a description can have, and whether it is fitted."""

    parameter: Parameter
    fitted: bool = True

    @property
    def possible(self) -> bool:
        """A factor of zero stays zero."""
        return self.parameter.scale == "linear" or self.parameter.nominal != 0.0


def _every(machine: Machine) -> list[_Declared]:
    """All parameters of a machine at their defaults."""
    found = [*_materials(machine), *_nodes(machine), *_contacts(machine), *_tanks(machine), *_environments(machine)]
    for name, source in machine.sources.items():
        found.append(_scale(f"sources.{name}.gain", "source", (name,), source.gain, "1", GAIN_OF_SOURCE, WIDE))
    for name, film in machine.films.items():
        found.append(_scale(f"films.{name}.gain", "film", (name,), film.gain, "1", GAIN_OF_FILM, WIDE))
    return [*found, *_tcp(machine)]


def _scale(
    path: str, kind: Kind, targets: Sequence[str], nominal: float, unit: str, tolerance: float, bound: float
) -> _Declared:
    """A parameter that multiplies what it acts on; negative ones (expansions of some composites) stay negative."""
    low, high = sorted((nominal / bound, nominal * bound))
    parameter = Parameter(path, kind, tuple(targets), nominal, unit, low, high, math.log1p(tolerance))
    return _Declared(parameter, fitted=nominal != 0.0)


def _materials(machine: Machine) -> Iterator[_Declared]:
    """Of materials that are used."""
    # The row of a bar that is a screw and in [tcp.expansion] or [scales] too is no multiple of its material's expansion
    other = {*machine.tcp.expansion, *(owner_of(scale.surface) for scale in machine.scales.values())}
    mixed = {b.material for n, b in machine.bars.items() if n in machine.tcp.screws and n in other}
    for name, material in machine.materials.items():
        parts = [n for n, part in machine.parts.items() if part.material == name]
        nodes = [n for n, node in machine.nodes.items() if node.material == name]
        bars = [n for n, bar in machine.bars.items() if bar.material == name]
        path = f"materials.{name}"
        if members := [*parts, *nodes, *bars]:
            capacity, unit = material.heat_capacity, "J/(kg*K)"
            yield _scale(f"{path}.heat_capacity", "capacity", members, capacity, unit, HEAT_CAPACITY, NARROW)
        growing = [*(parts if machine.has_tcp else ()), *(bar for bar in bars if bar in machine.tcp.screws)]
        if growing and name not in mixed:
            alpha = material.expansion
            yield _scale(f"{path}.expansion", "expansion", growing, alpha, "1/K", EXPANSION, EXPANSION_BOUND)


def _nodes(machine: Machine) -> Iterator[_Declared]:
    """Of nodes with a given capacity; others have that of their material."""
    for name, node in machine.nodes.items():
        if node.capacity is not None:
            path = f"nodes.{name}.capacity"
            yield _scale(path, "capacity", (name,), node.capacity, "J/K", NODE_CAPACITY, WIDE)


def _contacts(machine: Machine) -> Iterator[_Declared]:
    for name, contact in machine.contacts.items():
        kind: Kind = "joint" if contact.kind == "fixed" else "contact"
        if contact.total is not None:
            key, value, unit = "total", contact.total, "W/K"
        elif contact.joint is not None:
            key, value, unit = "joint.gain", contact.joint.gain, "1"
        else:
            key, value, unit = "conductance", wiring.joint_conductance(name, machine), "W/(m^2*K)"
        yield _scale(f"contacts.{name}.{key}", kind, (name,), value, unit, CONDUCTANCE, WIDE)


def _tanks(machine: Machine) -> Iterator[_Declared]:
    for name, tank in machine.tanks.items():
        path = f"{TANKS}{name}.capacity"
        yield _scale(path, "capacity", (f"{TANKS}{name}",), tank.capacity, "J/K", NODE_CAPACITY, WIDE)


def _environments(machine: Machine) -> Iterator[_Declared]:
    """Of environments that a film meets or sees."""
    met = {name for film in machine.films.values() for name in (film.environment, film.radiant)}
    for name, entry in machine.environment.items():
        if name in met:
            path, low, high = f"environment.{name}.offset", entry.offset - OFFSET_BOUND, entry.offset + OFFSET_BOUND
            offset = Parameter(path, "environment", (name,), entry.offset, "K", low, high, OFFSET, "linear")
            yield _Declared(offset, fitted=entry.signal is not None)


def _tcp(machine: Machine) -> Iterator[_Declared]:
    """Of lumped machines: what nodes beside parts move was found beside the parts, and is fitted with them."""
    if not machine.lumped:
        return
    for place, row in machine.tcp.expansion.items():
        sigma = TCP_EXPANSION * max(abs(v) for v in row)
        for component, value in enumerate(row):
            path, far = f"tcp.expansion.{place}.{'xyz'[component]}", TCP_BOUND * sigma
            low, high = value - far, value + far
            growth = Parameter(path, "expansion", (place,), value, "m/K", low, high, sigma, "linear", component)
            yield _Declared(growth, fitted=sigma > 0.0)


def _declared(machine: Machine) -> tuple[list[_Declared], list[Problem]]:
    """All parameters after the tables, in their order; and what is wrong with the tables."""
    every = {d.parameter.path: d for d in _every(machine)}
    largest = {path: d.parameter.sigma / TCP_EXPANSION for path, d in every.items()}  # of a tcp.expansion: of its node
    problems: dict[str, Problem] = {}  # by place: one table may match a hundred parameters
    for i, entry in enumerate(machine.parameters):
        if entry is None:  # broken, and reported on reading
            continue
        where = f"parameters.{i}"
        matched = [path for path in every if fnmatchcase(path, entry.path)]
        possible = [path for path in matched if every[path].possible]
        if not matched:
            what = f"no parameter of this machine is called '{entry.path}'"
            problems[f"{where}.path"] = Problem(what, f"{where}.path", _meant(entry.path, list(every)))
        elif not possible and not entry.fixed:
            remedy = "give it a value above zero in the description, or leave it out here"
            what = f"{matched[0]} is 0, and stays 0 whatever multiplies it"
            problems[f"{where}.path"] = Problem(what, f"{where}.path", remedy)
        for path in possible:
            try:
                every[path] = _told(every[path].parameter, entry, where, largest[path])
            except TwinError as e:
                for problem in e.problems:
                    problems.setdefault(problem.where, problem)
    return list(every.values()), list(problems.values())


def _told(p: Parameter, entry: ParameterEntry, where: str, largest: float) -> _Declared:
    """A parameter as a table has it; what the table leaves out stays. largest: what a share of a component is a share
    of. Raises DescriptionError."""
    problems: list[Problem] = []
    if entry.tolerance is not None:
        p = _with_tolerance(p, entry.tolerance, where, largest, problems)
    unit = "" if p.unit == "1" else f" {p.unit}"
    shown = f'"{p.nominal:g}{unit}"' if unit else f"{p.nominal:g}"
    if entry.low is not None:
        p = replace(p, low=_si(p, f"{where}.low", entry.low, p.unit, f"{shown} or less", problems))
    if entry.high is not None:
        p = replace(p, high=_si(p, f"{where}.high", entry.high, p.unit, f"{shown} or more", problems))
    if not problems and (entry.low is not None or entry.high is not None):
        problems += _bounds_problems(p, entry, where)
    if problems:
        raise DescriptionError.collect(problems)
    return _Declared(p, fitted=not entry.fixed and p.sigma > 0.0)


def _si(p: Parameter, place: str, value: float | str, unit: str, example: str, problems: list[Problem]) -> float:
    """A number of the table in SI; NaN with what is wrong added to `problems`."""
    key = place.rpartition(".")[2]
    try:
        return to_si(value, unit)
    except ValueError as e:
        relative = key == "tolerance" and p.scale == "log"
        what = f"the tolerance {value!r} is not relative" if relative else str(e)
        problems.append(Problem(f"{p.path}: {what}", place, f"write {key} = {example}"))
        return math.nan


def _with_tolerance(
    p: Parameter, given: float | str, where: str, largest: float, problems: list[Problem]
) -> Parameter:  # fmt: skip
    """The parameter with the sigma of a tolerance; what is wrong with the tolerance is added to `problems`."""
    example, dimension, most = _tolerances(p)
    if p.component >= 0 and isinstance(given, str) and given.rstrip().endswith("%"):
        given = _si(p, f"{where}.tolerance", given, "1", '"30 %"', problems) * largest
    tolerance = _si(p, f"{where}.tolerance", given, dimension, example, problems)
    if not 0.0 < tolerance <= most and not problems:
        shown = f"({100 * tolerance:g} %)" if dimension == "1" else dimension
        what = f"{p.path}: a tolerance of {tolerance:g} {shown}"
        remedy = f"write tolerance = {example}; what is certain is fixed = true"
        problems.append(Problem(what, f"{where}.tolerance", remedy))
    sigma = math.log1p(tolerance) if p.scale == "log" and tolerance > 0.0 else tolerance
    if p.scale == "linear" and p.component >= 0:  # its bounds are made of its tolerance
        far = TCP_BOUND * sigma
        return replace(p, sigma=sigma, low=min(p.low, p.nominal - far), high=max(p.high, p.nominal + far))
    return replace(p, sigma=sigma)


def _bounds_problems(p: Parameter, entry: ParameterEntry, where: str) -> Iterator[Problem]:
    """The first that is wrong with the bounds."""
    unit = "" if p.unit == "1" else f" {p.unit}"
    at = f"{where}.{'low' if entry.low is not None else 'high'}"
    bounds = f"{p.low:g} .. {p.high:g}{unit}"
    if not p.low < p.high:
        remedy = "give both, low < high" if None in (entry.low, entry.high) else "give low < high"
        yield Problem(f"{p.path}: the bounds {bounds} are empty", at, remedy)
    elif not p.low <= p.nominal <= p.high:
        what = f"{p.path} is {p.nominal:g}{unit}, outside its bounds {bounds}"
        yield Problem(what, at, "widen the bounds, or correct the value in the description")
    elif p.scale == "log" and p.low <= 0.0 <= p.high:
        what = f"{p.path}: bounds {bounds} of a factor include zero"
        yield Problem(what, at, f"keep them on the side of {p.nominal:g}")


def _tolerances(p: Parameter) -> tuple[str, str, float]:
    """How a tolerance of a parameter is written, its unit, and the largest that is none by mistake."""
    if p.scale == "log":
        return '"30 %"', "1", UNKNOWN
    return ('"0.5 K"', "K", math.inf) if p.unit == "K" else ('"1 um/K"', "m/K", GROWTH)


def _meant(path: str, every: list[str]) -> str:
    """A remedy for a path that matches nothing; for one with wildcards the paths with wildcards for names."""
    if "*" in path or "?" in path:
        every = list(dict.fromkeys(_wild(p) for p in every))
    return did_you_mean(path, every, "parameters")


def _wild(path: str) -> str:
    section, *rest = path.split(".")
    at = 1 if section == "tcp" else 0  # tcp.expansion.NODE.x
    return ".".join([section, *rest[:at], "*", *rest[at + 1 :]])
