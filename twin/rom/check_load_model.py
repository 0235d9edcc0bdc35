"""Does everything in a load model point to something: signals, environments, ports, and are its numbers possible?

Types are checked where the JSON is read (`twin.rom.from_json`), laws where they are evaluated (`twin.rom.check_laws`:
who reads an artefact must not wait for JAX); here what needs more than one entry to be seen.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import pairwise

from twin.nearest import did_you_mean
from twin.rom.load_model import Film, Joint, LoadModel, Pair, Source
from twin.rom.model import AffineBody
from twin.rom.parameter import Parameter

KINDS = ("value", "rms", "peak")  # of signals


def check_load_model(load: LoadModel) -> str:
    """One line that says what was checked. Raises KeyError for the first thing that means nothing or cannot be."""
    for kind in ("signals", "axes", "environments", "sources", "films"):
        _unique([entry.name for entry in getattr(load, kind)], kind)
    _unique(load.theta_names, "coefficients")
    _unique(load.ports, "ports")
    for s in load.signals:
        if s.kind not in KINDS or not s.low <= s.high:
            raise KeyError(f"'load_model.signals.{s.name}' is of no kind of {', '.join(KINDS)}, or has no range")
    signals = {s.name for s in load.signals}
    for axis in load.axes:
        _known([axis.position], signals, f"axes.{axis.name}")
    for e in load.environments:
        _known([name for name in (e.signal, e.switch) if name], signals, f"environments.{e.name}")
    for source in load.sources:
        _source(source, load, signals)
    for film in load.films:
        _film(film, len(load.environments), signals)
    for joint in load.joints:
        _conductance(joint, f"joints.{joint.name}", signals)
    _rails(load)
    for k, pair in enumerate(load.pairs):
        _pair(pair, f"pairs[{k}]", load, signals)
    return (
        f"{len(load.signals)} signals, {len(load.sources)} sources, {len(load.films)} films, {len(load.joints)} "
        f"joints, {len(load.pairs)} pairs on {len(load.rails)} rails: types, names, indices and bounds"
    )


def check_parameters(parameters: Sequence[Parameter], load: LoadModel, bodies: Sequence[AffineBody]) -> None:
    """Raises KeyError where a parameter acts on nothing, or its bounds, value and deviation cannot be."""
    members = [name for body in bodies for name in body.members]
    names: dict[str, Sequence[str]] = {
        "source": [s.name for s in load.sources],
        "film": [f.name for f in load.films],
        "joint": [j.name for j in load.joints],
        "contact": load.contacts,
        "environment": [e.name for e in load.environments],
        "capacity": members,
        "expansion": members,
    }
    for p in parameters:
        for target in p.targets:
            if target not in names[p.kind]:
                raise KeyError(f"'parameters.{p.path}' acts on '{target}', which is no {p.kind} of the model")
        if p.sigma <= 0.0 or p.low > p.high or (p.scale == "log" and p.nominal <= 0.0):
            raise KeyError(f"'parameters.{p.path}' has no deviation, no range, or no positive value")


def check_index(index: int, count: int, where: str) -> None:
    """Raises KeyError where `index` is none of `count` entries; Python would count negative ones from the end."""
    if not 0 <= index < count:
        raise KeyError(f"'{where}' is {index}, and there are {count}")


def _unique(names: Iterable[str], kind: str) -> None:
    twice = [name for name, n in Counter(names).items() if n > 1]
    if twice:
        raise KeyError(f"'load_model.{kind}' has '{twice[0]}' twice")


def _known(names: Iterable[str], signals: set[str], where: str) -> None:
    for name in names:
        if name not in signals:
            raise KeyError(f"'load_model.{where}' reads '{name}': {did_you_mean(name, signals, 'signals')}")


def _source(source: Source, load: LoadModel, signals: set[str]) -> None:
    where = f"sources.{source.name}"
    _known(source.use.signals.values(), signals, where)
    if source.contact and source.contact not in load.contacts:
        raise KeyError(f"'load_model.{where}' heats the contact '{source.contact}', which no pair has")
    if not 0.0 <= source.rail_share <= 1.0:
        raise KeyError(f"'load_model.{where}.rail_share' is {source.rail_share:g}, not 0 .. 1")


def _film(film: Film, environments: int, signals: set[str]) -> None:
    where = f"films.{film.name}"
    _known(film.use.signals.values(), signals, where)
    check_index(film.environment, environments, f"load_model.{where}.environment")
    check_index(film.radiant, environments, f"load_model.{where}.radiant")
    if film.gain < 0.0 or not 0.0 <= film.emissivity <= 1.0 or not 0.0 <= film.low <= film.high:
        raise KeyError(f"'load_model.{where}' has a gain below 0, an emissivity outside 0 .. 1, or no range")


def _conductance(contact: Joint | Pair, where: str, signals: set[str]) -> None:
    if contact.conductance < 0.0 or contact.switched <= 0.0:
        raise KeyError(f"'load_model.{where}' has a conductance below 0")
    _known([contact.switch] if contact.switch else [], signals, where)


def _rails(load: LoadModel) -> None:
    for rail in load.rails:
        where = f"load_model.rails.{rail.name}"
        if not rail.stations or any(b <= a for a, b in pairwise(rail.stations)):
            raise KeyError(f"'{where}.stations' do not increase")
        check_index(rail.first_port, len(load.ports), f"{where}.first_port")
        check_index(rail.first_port + len(rail.stations) - 1, len(load.ports), f"{where}: its last port")


def _pair(pair: Pair, where: str, load: LoadModel, signals: set[str]) -> None:
    check_index(pair.axis, len(load.axes), f"load_model.{where}.axis")
    check_index(pair.rail, len(load.rails), f"load_model.{where}.rail")
    check_index(pair.pad_port, len(load.ports), f"load_model.{where}.pad_port")
    _conductance(pair, where, signals)
    if pair.area <= 0.0 or pair.assignment not in ("interpolated", "segment"):
        raise KeyError(f"'load_model.{where}' has no area, or its assignment is neither 'interpolated' nor 'segment'")
