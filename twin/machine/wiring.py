"""Signals, laws, sources and films of a description as the runtime knows them: SI numbers, defaults filled in."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from twin.errors import DescriptionError, Problem, TwinError
from twin.machine import description
from twin.machine.description import Machine
from twin.machine.kinematics import direction
from twin.nearest import did_you_mean, nearest
from twin.physics.laws import LAWS, Argument
from twin.rom.load_model import AxisWiring, EnvironmentWiring, LawUse, RotaryWiring, Signal, Source
from twin.units import parse_unit, to_si

SWITCH = Argument("1", "a switch, 0 off and 1 on", low=0.0, high=1.0)
PAINT = 0.9  # emissivity of painted and of rough oxidised surfaces (VDI-Waermeatlas, K3: 0.85 to 0.95)


def signal(name: str, entry: description.SignalEntry) -> Signal:
    """A signal with its certified range in SI; amplitudes of "peak" signals as rms, as laws and checks see them.

    Raises DescriptionError for an unknown unit, or a range that is empty or of another dimension.
    """
    where = f"signals.{name}"
    try:
        unit = parse_unit(entry.unit)
    except ValueError as e:
        raise DescriptionError(str(e), f"{where}.unit", "write it like mm, m/min, A, degC, 1/min") from e
    ends = []
    for end in entry.range:
        try:
            ends.append(to_si(end if isinstance(end, str) else f"{float(end)!r} {entry.unit}", unit.si))
        except ValueError as e:
            raise DescriptionError(str(e), f"{where}.range", f"numbers in {entry.unit}, or strings with a unit") from e
    default = entry.default
    if default is not None:
        try:
            default = to_si(default if isinstance(default, str) else f"{float(default)!r} {entry.unit}", unit.si)
        except ValueError as e:
            raise DescriptionError(str(e), f"{where}.default", f"a number in {entry.unit}, or with a unit") from e
    if not entry.factor:
        raise DescriptionError("a factor of zero", f"{where}.factor", "logged values are multiplied by it")
    if entry.kind == "peak":
        ends = [e / math.sqrt(2.0) for e in ends]
        default = None if default is None else default / math.sqrt(2.0)
    low, high = ends
    if not low < high:
        raise DescriptionError(
            f"the range {list(entry.range)} is empty", f"{where}.range", "give [low, high] with low < high"
        )
    if default is not None and not low <= default <= high:
        what = f"the default {entry.default} is outside the range {list(entry.range)}"
        raise DescriptionError(what, f"{where}.default", "the model must be certified for it")
    return Signal(name, entry.column or name, unit.si, entry.kind, low, high, default, entry.factor)


def environment(name: str, entry: description.Environment, machine: Machine) -> EnvironmentWiring:
    """An environment. Raises DescriptionError unless either a signal or a temperature is given."""
    where = f"environment.{name}"
    if (entry.signal is None) == (entry.temperature is None):
        raise DescriptionError(
            "give either a signal or a temperature", where, 'signal = "shop_air" or temperature = "20 degC"'
        )
    if (entry.switch is None) != ("switched_offset" not in entry.model_fields_set):
        remedy = 'switch = "door" and switched_offset = "-3 K", or neither'
        raise DescriptionError("a switch and what it switches belong together", f"{where}.switch", remedy)
    if entry.switch is not None:
        expect_switch(entry.switch, f"{where}.switch", machine)
    temperature = float(entry.temperature or 0.0)
    if entry.signal is not None:
        expect_signal(entry.signal, "degC", f"{where}.signal", machine)
        temperature = machine.machine.reference_temperature
    return EnvironmentWiring(
        name=name,
        signal=entry.signal or "",
        temperature=temperature,
        gradient=entry.gradient,
        height=entry.height,
        offset=entry.offset,
        switch=entry.switch or "",
        switched_offset=entry.switched_offset,
    )


def axis(name: str, machine: Machine) -> AxisWiring:
    """A linear axis. Raises DescriptionError for an empty stroke, a zero direction, or a position that is no length."""
    entry = machine.axes[name]
    expect_signal(entry.position, "m", f"axes.{name}.position", machine)
    low, high = entry.stroke
    if not low < high:
        raise DescriptionError(
            f"the stroke {list(entry.stroke)} m is empty", f"axes.{name}.stroke", "give [low, high] with low < high"
        )
    x, y, z = (float(d) for d in direction(machine, name))
    return AxisWiring(name, (x, y, z), low, high, entry.position)


def rotary(name: str, machine: Machine) -> RotaryWiring:
    """A rotary axis that turns the tool or the work. Raises DescriptionError for a position that is no angle."""
    expect_signal(machine.axes[name].position, "rad", f"axes.{name}.position", machine)
    return RotaryWiring(name, machine.axes[name].position)


def source(name: str, entry: description.Source, machine: Machine) -> Source:
    """A source. Raises DescriptionError with all problems of its place and its law."""
    where = f"sources.{name}"
    if (entry.surface is None) == (entry.contact is None):
        raise DescriptionError(
            "give either a surface or a contact", where, 'surface = "part.surface" or contact = "x_guide"'
        )
    contact = machine.contacts.get(entry.contact) if entry.contact else None
    if entry.contact is not None and (entry.contact not in machine.contacts or (contact and contact.kind != "moving")):
        moving = [c for c, other in machine.contacts.items() if other and other.kind == "moving"]
        remedy = did_you_mean(entry.contact, moving, "moving contacts")
        raise DescriptionError(f"unknown moving contact '{entry.contact}'", f"{where}.contact", remedy)
    use = law_use(entry.law, "loss", entry.parameters, entry.signals, where, machine)
    free = sorted(set(LAWS[use.law].states) - set(use.signals))
    if free and entry.contact:
        raise DescriptionError(
            f"law '{use.law}' needs {', '.join(free)}, which a moving contact has no single value of",
            f"{where}.signals",
            "wire a logged temperature, choose a law without it, or put the source on a surface",
        )
    return Source(name, use, entry.gain, entry.contact or "", entry.rail_share)


def film_law(name: str, entry: description.Film, machine: Machine) -> LawUse:
    """The law of a film. Raises DescriptionError with all problems of its environments and its law."""
    where = f"films.{name}"
    problems = []
    for key, named in (("environment", entry.environment), ("radiant", entry.radiant)):
        if named is not None and named not in machine.environment:
            remedy = did_you_mean(named, machine.environment, "environments")
            problems.append(Problem(f"unknown environment '{named}'", f"{where}.{key}", remedy))
    try:
        use = law_use(entry.law, "film", entry.parameters, entry.signals, where, machine)
        if entry.emissivity and not LAWS[use.law].radiates:
            what = f"surfaces of law '{use.law}' do not see their surroundings"
            problems.append(Problem(what, f"{where}.emissivity", "remove it: they do not radiate"))
        if entry.additional and (entry.emissivity or entry.radiant is not None):
            key, what = ("emissivity" if entry.emissivity else "radiant"), "an additional film does not radiate"
            problems.append(Problem(what, f"{where}.{key}", "remove it: give it to the surface's own film"))
    except TwinError as e:
        raise DescriptionError.collect([*problems, *e.problems]) from e
    if problems:
        raise DescriptionError.collect(problems)
    return use


def emissivity(entry: description.Film) -> float:
    """Of a film's surfaces: as described, else of paint where the law's surfaces see their surroundings.

    Zero of additional films: radiation is left to the surface's own.
    """
    if entry.additional:
        return 0.0
    if entry.emissivity is not None:
        return entry.emissivity
    return PAINT if LAWS[entry.law].radiates else 0.0


def joint_conductance(name: str, machine: Machine) -> float:
    """W/(m^2 K) of a contact, given or by a law of kind "joint"; W/K where its `total` is given (lumped machines).

    Raises DescriptionError unless exactly one is there.
    """
    entry, where = machine.contacts[name], f"contacts.{name}"
    if entry.total is not None:
        return entry.total
    if (entry.conductance is None) == (entry.joint is None):
        raise DescriptionError(
            "give either a conductance or a joint law",
            where,
            'conductance = "2000 W/(m^2*K)", or joint = { law = "bolted_joint", parameters = { ... } }',
        )
    if entry.joint is None:
        return float(entry.conductance or 0.0)
    if entry.kind != "fixed":
        raise DescriptionError("a joint law is for fixed contacts", f"{where}.joint", "give a conductance")
    use = law_use(entry.joint.law, "joint", entry.joint.parameters, {}, f"{where}.joint", machine)
    law = LAWS[use.law]
    values = {n: use.parameters.get(n, a.default) for n, a in law.parameters.items()}
    value = float(law.function(**values))
    if not (value > 0 and math.isfinite(value)):
        bolts = "torque, pitch, flank_diameter, hole_diameter, head_diameter and area with the bolts"
        remedy = f"give the pressure, or {bolts}" if "pressure" in law.parameters else "check its parameters"
        raise DescriptionError(f"law '{use.law}' gives {value:g} W/(m^2 K)", f"{where}.joint.parameters", remedy)
    return entry.joint.gain * value


def law_use(
    law_name: str,
    kind: str,
    parameters: Mapping[str, float | str],
    signals: Mapping[str, str],
    where: str,
    machine: Machine,
) -> LawUse:
    """A law with parameters in SI, defaults filled in, and its signals. Raises DescriptionError with all problems."""
    law = LAWS.get(law_name)
    if law is None or law.kind != kind:
        known = [n for n, row in LAWS.items() if row.kind == kind]
        raise DescriptionError(
            f"'{law_name}' is no {kind} law", f"{where}.law", did_you_mean(law_name, known, f"{kind} laws")
        )
    problems = _names(law_name, parameters, law.parameters, f"{where}.parameters", "parameters")
    # a state of the model may be wired to a signal that measures it
    problems += _names(law_name, signals, law.signals, f"{where}.signals", "signals", law.states)
    values: dict[str, float] = {}
    for name, argument in law.parameters.items():
        given = parameters.get(name, argument.default)
        if given is None:
            continue
        at = f"{where}.parameters.{name}"
        try:
            values[name] = to_si(given, argument.unit)
        except ValueError as e:
            problems.append(Problem(str(e), at, f"{argument.meaning}, in {argument.unit}"))
            continue
        if not argument.low <= values[name] <= argument.high:
            bounds = f"{argument.low:g} .. {argument.high:g} {argument.unit}"
            problems.append(Problem(f"{values[name]:g} is outside {bounds}", at, f"{argument.meaning}: check the unit"))
    readable = {**law.signals, **law.states}
    for name, argument in readable.items():
        if name in signals:
            at = f"{where}.signals.{name}"
            try:
                expect_signal(signals[name], argument.unit, at, machine)
            except TwinError as e:
                problems += e.problems
                continue
            problems += _beyond(argument, signals[name], at, machine)
    if problems:
        raise DescriptionError.collect(problems)
    return LawUse(law_name, values, {name: signals[name] for name in readable if name in signals})


def _beyond(argument: Argument, name: str, where: str, machine: Machine) -> list[Problem]:
    """Whether the certified range of a signal goes outside what an argument of a law can be."""
    entry = machine.signals[name]
    try:
        wired = signal(name, entry) if entry else None
    except TwinError:
        return []  # reported with the signal itself
    if wired is None or (argument.low <= wired.low and wired.high <= argument.high):
        return []
    reaches = f"signal '{name}' ranges from {wired.low:g} to {wired.high:g} {wired.unit}"
    bounds = f"{argument.low:g} .. {argument.high:g} {argument.unit}"
    remedy = f"{argument.meaning}: fix signals.{name}.range or its unit, or wire another signal"
    return [Problem(f"{reaches}, outside {bounds}", where, remedy)]


def _names(
    law: str,
    given: Iterable[str],
    arguments: Mapping[str, Argument],
    where: str,
    what: str,
    optional: Mapping[str, Argument] = {},
) -> list[Problem]:
    """Unknown names, and names without a default that are not given."""
    given, known = list(given), {**arguments, **optional}
    problems = [
        Problem(f"law '{law}' has no '{name}'", f"{where}.{name}", did_you_mean(name, known, what))
        for name in given
        if name not in known
    ]
    mistyped = {nearest(name, known) for name in given if name not in known}
    for name, argument in arguments.items():
        if name == "area" and what == "parameters":
            continue  # the build knows the area of a film's surfaces
        if name not in given and name not in mistyped and argument.default is None:
            problems.append(Problem(f"law '{law}' needs '{name}'", where, f"{argument.meaning}, in {argument.unit}"))
    return problems


def expect_switch(name: str, where: str, machine: Machine) -> None:
    """Raise DescriptionError unless `name` is a signal without unit that stays within 0 .. 1."""
    expect_signal(name, SWITCH.unit, where, machine)
    if problems := _beyond(SWITCH, name, where, machine):
        raise DescriptionError.collect(problems)


def expect_signal(name: str, si: str, where: str, machine: Machine) -> None:
    """Raise DescriptionError unless `name` is a signal whose unit has the dimension of `si`."""
    if name not in machine.signals:
        raise DescriptionError(f"unknown signal '{name}'", where, did_you_mean(name, machine.signals, "signals"))
    entry = machine.signals[name]
    try:
        found = parse_unit(entry.unit).si if entry else si
    except ValueError:
        return  # reported with the signal itself
    if found != si:
        raise DescriptionError(
            f"signal '{name}' is in {entry.unit}, expected a unit of {si}",
            where,
            "wire another signal, or fix its unit",
        )
