"""What the laws of a description give at a stated load, and from what: no mesh is needed.

A load is one point (the upper bound of every signal's certified range, unless set otherwise) or all samples of a run.
Temperatures that the model would fill in are stated too: a winding or bearing has the machine's reference temperature,
a film's surface is 10 K above its environment.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.errors import LogError, TwinError
from twin.logs.run import Run
from twin.logs.signals import signal_values
from twin.machine import wiring
from twin.machine.check_lumped import film_area
from twin.machine.description import Machine
from twin.nearest import did_you_mean
from twin.physics.laws import LAWS, Argument
from twin.physics.radiation import radiation_coefficient
from twin.rom.load_model import LawUse
from twin.units import parse_unit, to_si

WARMER = 10.0  # K, a film's surface above its environment unless stated
STATES = ("temperature", "surface", "ambient")
_ONE_STEP_LATE = "from the model, one step late"


@dataclass(frozen=True)
class Load:
    """Signals and temperatures at which laws are evaluated; n samples, one without a run."""

    time: np.ndarray  # (n,) s
    signals: Mapping[str, np.ndarray]  # (n,) each, SI, currents rms
    told: Mapping[str, str]  # of each signal: where its values come from
    states: Mapping[str, float]  # degC: temperature, surface, ambient as set

    def mean(self, values: np.ndarray) -> float:
        """Over time; a sample holds until the next."""
        spans = np.diff(self.time)
        return float(spans @ values[:-1] / spans.sum()) if len(spans) else float(values[0])


@dataclass(frozen=True)
class Input:
    """An argument of a law with its value."""

    name: str
    value: np.ndarray  # (n,) SI, or (1,)
    unit: str
    meaning: str
    origin: str  # signal, parameter path, default, or the model


@dataclass(frozen=True)
class Explanation:
    """A source, film or contact: its law at a load."""

    path: str  # "sources.x_motor"
    kind: str  # "source", "film" or "contact"
    law: str  # "" where a contact's conductance is given
    formula: str
    citation: str
    inputs: tuple[Input, ...]
    unit: str  # "W" or "W/(m^2*K)"
    value: np.ndarray  # (n,) heat, or convection, gain included
    radiation: np.ndarray | None  # (n,) W/(m^2 K), films only
    validity: str
    holds: np.ndarray  # (n,) bool
    place: str  # where it acts


def load_of(machine: Machine, settings: Mapping[str, str], run: Run | None = None) -> Load:
    """The load of a run, or of the upper bounds; `settings` (signal or state -> text with a unit) win over both.

    A bare number is in the signal's own unit, in degC for a state. "signals.ambient" and "model.ambient" are the signal
    and the state of that name; "ambient" alone is refused where there are both. Amplitudes of "peak" signals are turned
    into rms.
    Raises TwinError for unknown names and units; LogError for a run without a signal that a law reads.
    """
    known = {name: wiring.signal(name, entry) for name, entry in machine.signals.items()}
    fixed, states = _settings(machine, settings)
    if run is None:
        time = np.zeros(1)
        values = {name: np.array([s.high]) for name, s in known.items()}
        told = dict.fromkeys(known, "upper bound of its certified range")
    else:
        time = run.loads.time
        if len(time) == 0 or not np.all(np.diff(time) > 0.0):
            raise LogError("times do not increase strictly", str(run.folder), "run `twin check` on the run folder")
        wanted = _read_by_laws(machine) - set(fixed)
        logged = signal_values(run, [s for name, s in known.items() if name in wanted])
        values = {name: _held(column, name, run) for name, column in logged.items()}
        told = dict.fromkeys(values, str(run.folder))
        for name in wanted - set(logged):  # what signal_values leaves out has a default
            values[name] = np.full(len(time), known[name].default)
            told[name] = "default: not logged"
    for name, value in fixed.items():
        values[name] = np.full(len(time), value)
        told[name] = "set"
    for name, entry in machine.signals.items():
        if entry.kind == "peak" and name in told:
            told[name] += ", peak turned into rms"
    return Load(time, values, told, states)


def _settings(machine: Machine, settings: Mapping[str, str]) -> tuple[dict[str, float], dict[str, float]]:
    """Signals (rms, SI) and states of the model that are set. Raises TwinError for unknown names and units."""
    states: dict[str, float] = {}
    fixed: dict[str, float] = {}
    for given, text in settings.items():
        kind, _, rest = given.partition(".")
        name = rest if kind in ("signals", "model") else given
        if given in machine.signals and given in STATES:
            what = f"'{given}' is a signal and a temperature of the model"
            raise TwinError(what, "--set", f"write signals.{given}={text}, or model.{given}={text}")
        if name in machine.signals and kind != "model":
            entry = machine.signals[name]
            rms = math.sqrt(2.0) if entry.kind == "peak" else 1.0
            fixed[name] = _setting(name, text, entry.unit) / rms
        elif name in STATES and kind != "signals":
            states[name] = _setting(name, text, "degC")
        else:
            remedy = did_you_mean(name, [*machine.signals, *STATES], "signals and temperatures of the model")
            raise TwinError(f"nothing called '{given}' to set", "--set", remedy)
    return fixed, states


def _setting(name: str, text: str, unit: str) -> float:
    try:
        si = parse_unit(unit).si
        try:
            return to_si(f"{float(text)!r} {unit}", si)
        except ValueError:
            return to_si(text, si)
    except ValueError as e:
        raise TwinError(
            str(e), f"--set {name}", f"write a number in {unit}, for example --set {name}='1 {unit}'"
        ) from e


def _read_by_laws(machine: Machine) -> set[str]:
    wired = {name for source in machine.sources.values() for name in source.signals.values()}
    wired |= {name for film in machine.films.values() for name in film.signals.values()}
    return wired | {name for e in machine.environment.values() for name in (e.signal, e.switch) if name is not None}


def _held(column: np.ndarray, name: str, run: Run) -> np.ndarray:
    """Gaps filled with the last value, as a run of the model does."""
    lost = ~np.isfinite(column)
    if lost.all():
        raise LogError("no valid value at all", f"{run.folder}: {name}", "check the column, or set it: --set")
    last = np.maximum.accumulate(np.where(lost, -1, np.arange(len(column))))
    return column[np.where(last < 0, np.argmin(lost), last)]


def paths(machine: Machine) -> list[str]:
    """What can be explained."""
    sources = [f"sources.{name}" for name in machine.sources]
    return [*sources, *(f"films.{name}" for name in machine.films), *(f"contacts.{name}" for name in machine.contacts)]


def explain(machine: Machine, path: str, load: Load) -> Explanation:
    """The law behind "sources.NAME", "films.NAME" or "contacts.NAME" at a load.

    Raises TwinError for an unknown path, DescriptionError for a law without a parameter or signal it needs.
    """
    known = paths(machine)
    if path not in known:
        raise TwinError(f"nothing called '{path}' in the machine", "--explain", did_you_mean(path, known, "paths"))
    section, _, name = path.partition(".")
    return {"sources": _source, "films": _film, "contacts": _contact}[section](machine, name, load)


def _source(machine: Machine, name: str, load: Load) -> Explanation:
    entry = machine.sources[name]
    built = wiring.source(name, entry, machine)
    reference = machine.machine.reference_temperature
    states = {"temperature": (reference, f"{_ONE_STEP_LATE} (here the reference temperature)")}
    place = entry.surface or f"{entry.contact}, {100 * entry.rail_share:g} % of it into the rail"
    inputs = _inputs(built.use, f"sources.{name}", entry.parameters, load, states, machine)
    return _explained(f"sources.{name}", "source", built.use, inputs, built.gain, None, place, len(load.time))


def _film(machine: Machine, name: str, load: Load) -> Explanation:
    entry = machine.films[name]
    use = wiring.film_law(name, entry, machine)
    air = _environment(machine, entry.environment, load)
    ambient = load.states.get("ambient", air)
    surface = load.states.get("surface", ambient + WARMER)
    states = {
        "ambient": (ambient, f"environment {entry.environment}"),
        "surface": (surface, f"{_ONE_STEP_LATE} (here its environment + {WARMER:g} K)"),
    }
    # of meshes only the build knows it
    area = sum(film_area(machine, entry, place) for place in entry.surfaces) if machine.lumped else None
    inputs = _inputs(use, f"films.{name}", entry.parameters, load, states, machine, area)
    radiant = ambient if entry.radiant is None else _environment(machine, entry.radiant, load)
    emissivity = wiring.emissivity(entry)
    told = f"films.{name}.emissivity" if entry.emissivity is not None else "default of the law"
    inputs += (Input("emissivity", np.array([emissivity]), "1", "of the surfaces, for radiation", told),)
    if emissivity > 0.0:
        where = entry.radiant or entry.environment
        inputs += (Input("radiant", np.atleast_1d(radiant), "degC", "what the surfaces see", f"environment {where}"),)
    radiated = np.atleast_1d(radiation_coefficient(np.asarray(surface), np.asarray(radiant), emissivity))
    place = ", ".join(entry.surfaces)
    return _explained(f"films.{name}", "film", use, inputs, entry.gain, radiated, place, len(load.time))


def _contact(machine: Machine, name: str, load: Load) -> Explanation:
    entry = machine.contacts[name]
    path = f"contacts.{name}"
    if entry.joint is not None:
        wiring.joint_conductance(name, machine)  # raises what is wrong with it
        use = wiring.law_use(entry.joint.law, "joint", entry.joint.parameters, {}, f"{path}.joint", machine)
        inputs = _inputs(use, f"{path}.joint", entry.joint.parameters, load, {}, machine)
        return _explained(path, "contact", use, inputs, entry.joint.gain, None, " - ".join(entry.surfaces or ()), 1)
    if entry.total is not None:
        given = Input("total", np.array([entry.total]), "W/K", "of the joint, or of each pad", f"{path}.total")
    else:
        value = np.array([entry.conductance or 0.0])
        given = Input("conductance", value, "W/(m^2*K)", "of the joint, or per pad area", f"{path}.conductance")
    all_given: tuple[Input, ...] = (given,)
    if entry.switch is not None:
        what = f"factor where signal {entry.switch} is 1; not in the value below"
        all_given += (Input("switched", np.array([entry.switched or 1.0]), "1", what, f"{path}.switched"),)
    pairs = [entry.surfaces] if entry.surfaces else list(entry.pairs)
    place = ", ".join(" - ".join(pair) for pair in pairs)
    return Explanation(
        path, "contact", "", "constant", "given", all_given, given.unit, given.value, None, "", np.array([True]), place
    )


def _environment(machine: Machine, name: str, load: Load) -> np.ndarray:
    air = wiring.environment(name, machine.environment[name], machine)
    measured = load.signals[air.signal] if air.signal else np.array([air.temperature])
    switched = air.switched_offset * load.signals[air.switch] if air.switch else 0.0
    return measured + air.offset + switched


def _inputs(
    use: LawUse,
    where: str,
    parameters: Mapping[str, Any],
    load: Load,
    states: Mapping[str, tuple[Any, str]],
    machine: Machine,
    area: float | None = None,
) -> tuple[Input, ...]:
    law = LAWS[use.law]
    found = []

    def add(name: str, argument: Argument, value: Any, origin: str) -> None:
        found.append(
            Input(name, np.atleast_1d(np.asarray(value, dtype=float)), argument.unit, argument.meaning, origin)
        )

    for name, argument in {**law.signals, **law.states}.items():
        if name in use.signals:
            signal = use.signals[name]
            column = machine.signals[signal].column or signal
            add(name, argument, load.signals[signal], f"signal {signal} (column {column}): {load.told[signal]}")
        elif name in load.states:
            add(name, argument, load.states[name], f"{_ONE_STEP_LATE} (here as set)")
        else:
            add(name, argument, *states[name])
    for name, argument in law.parameters.items():
        if name in use.parameters:
            told = f"{where}.parameters.{name}" if name in parameters else "default of the law"
            add(name, argument, use.parameters[name], told)
        elif area is not None:
            add(name, argument, area, f"{where}.area")
        else:  # only the area of a channel may be missing: the build knows it
            channel = math.pi * use.parameters["diameter"] * use.parameters["channel_length"]
            add(name, argument, channel, "from the meshes (here pi times diameter times length of the channel)")
    return tuple(found)


def _explained(
    path: str,
    kind: str,
    use: LawUse,
    inputs: tuple[Input, ...],
    gain: float,
    radiation: np.ndarray | None,
    place: str,
    n: int,
) -> Explanation:
    law = LAWS[use.law]
    values = {i.name: i.value for i in inputs if i.name in {**law.signals, **law.states, **law.parameters}}
    result = gain * np.broadcast_to(np.asarray(law.function(**values)), (n,))
    holds: Any = law.validity.holds(**values) if law.validity else True
    at = "joint.gain" if kind == "contact" else "gain"
    inputs += (Input("gain", np.array([gain]), "1", "calibration factor of the law", f"{path}.{at}"),)
    return Explanation(
        path=path,
        kind=kind,
        law=use.law,
        formula=law.formula,
        citation=law.source,
        inputs=inputs,
        unit="W" if law.kind == "loss" else "W/(m^2*K)",
        value=result,
        radiation=None if radiation is None else np.broadcast_to(radiation, (n,)),
        validity=law.validity.text if law.validity else "",
        holds=np.broadcast_to(np.asarray(holds), (n,)),
        place=place,
    )
