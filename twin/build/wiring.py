"""The LoadModel of a machine: names, laws, parameters in SI, certified ranges; the runtime finds it in the artefact."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from twin.build.ports import ContactPorts, switch_of
from twin.errors import DescriptionError
from twin.machine import wiring
from twin.machine.description import Contact, Machine
from twin.machine.kinematics import linear_axes
from twin.machine.turning import turning_axes
from twin.physics.laws import LAWS
from twin.physics.radiation import radiation_coefficient
from twin.rom.law_values import law_table, law_values, states_of
from twin.rom.load_model import EnvironmentWiring, Film, Joint, LoadModel, Signal

FILM_MARGIN = (0.5, 2.0)  # certified film coefficients: from half the least to twice the greatest value of the law
# An additional film may be off: its certified range begins at this share of its greatest value, where it is as good as
# absent, because ranges are sampled on a logarithmic scale
LEAST_ADDITIONAL = 0.01
JOINT_MARGIN = 3.0  # certified joint conductances: a third to three times the described one, switched or not


# Certified surface temperatures, above and below the environment [K]. At equal temperatures no heat flows, so the least
# coefficient of free convection is taken just beside.
DIFFERENCES = np.array([-60.0, -10.0, -1.0, -0.01, 0.01, 1.0, 10.0, 60.0])


def load_model(machine: Machine, ports: ContactPorts, areas: Mapping[str, float]) -> LoadModel:
    """Everything that turns a load log into heat, of a description whose references are sound.

    areas: m^2 of every film's surfaces, for laws that need it.
    Raises DescriptionError for a film law that is not positive and finite within its signals' ranges.
    """
    signals = {name: wiring.signal(name, entry) for name, entry in machine.signals.items()}
    environments = tuple(wiring.environment(name, entry, machine) for name, entry in machine.environment.items())
    order = [e.name for e in environments]
    films = []
    for name, entry in machine.films.items():
        use = wiring.film_law(name, entry, machine)
        if "area" in LAWS[use.law].parameters and "area" not in use.parameters:
            use = replace(use, parameters={**use.parameters, "area": areas[name]})
        air = order.index(entry.environment)
        radiant = air if entry.radiant is None else order.index(entry.radiant)
        film = Film(name, use, air, 0.0, 0.0, entry.gain, wiring.emissivity(entry), radiant, entry.additional)
        low, high = film_range(film, environments, signals, f"films.{name}")
        films.append(replace(film, low=low, high=high))
    return LoadModel(
        signals=tuple(signals.values()),
        axes=tuple(wiring.axis(name, machine) for name in linear_axes(machine)),
        environments=environments,
        sources=tuple(wiring.source(name, entry, machine) for name, entry in machine.sources.items()),
        films=tuple(films),
        joints=tuple(
            _joint(name, wiring.joint_conductance(name, machine), c)
            for name, c in machine.contacts.items()
            if c.kind == "fixed"
        ),
        ports=ports.names,
        rails=ports.rails,
        pairs=ports.pairs,
        rotary=tuple(wiring.rotary(t.axis, machine) for t in turning_axes(machine)),
    )


def _joint(name: str, conductance: float, entry: Contact) -> Joint:
    key, (switch, switched) = "conductance" if entry.total is None else "total", switch_of(entry)
    low, high = conductance * min(1.0, switched) / JOINT_MARGIN, conductance * max(1.0, switched) * JOINT_MARGIN
    return Joint(name, conductance, low, high, key, switch, switched)


def film_range(
    film: Film, environments: tuple[EnvironmentWiring, ...], signals: Mapping[str, Signal], where: str
) -> tuple[float, float]:
    """Certified range [W/(m^2 K)] of a film: margins around its law and radiation over the corners of all ranges.

    Zero counts as a corner where a range includes it: laws in |v| have their least value there. Raises DescriptionError
    where the coefficient is not positive and finite: ranges are sampled on a logarithmic scale.
    """
    use, air = film.use, environments[film.environment]
    names = sorted({*use.signals.values(), *(name for name in (air.signal, air.switch) if name)})
    corners = _corners([(signals[n].low, signals[n].high) for n in names])
    values = dict(zip(names, corners.T, strict=True))
    ambient = (values[air.signal] if air.signal else np.full(len(corners), air.temperature)) + air.offset
    ambient = ambient + (air.switched_offset * values[air.switch] if air.switch else 0.0)
    surface = ambient[:, None] + DIFFERENCES
    free = states_of(use)
    if free:
        states = {"surface": surface, "ambient": ambient[:, None]}
        convection = law_table(use, values, len(corners), {name: states[name] for name in free})[0]
    else:
        convection = law_values([use], values, len(corners))
    radiant = _middle(environments[film.radiant], signals)
    h = film.gain * convection + radiation_coefficient(surface, radiant, film.emissivity)
    low, high = float(h.min()), float(h.max())
    if film.additional:
        low = max(low, LEAST_ADDITIONAL * high)
    if not (low > 0 and math.isfinite(high)):
        raise DescriptionError(
            f"law '{use.law}' gives {low:g} .. {high:g} W/(m^2 K) over its signals' ranges",
            where,
            "film coefficients are finite and above zero, at rest too: check parameters and ranges; "
            "list surfaces without convection under `adiabatic` of their part; a film that may be off is `additional`",
        )
    return FILM_MARGIN[0] * low, FILM_MARGIN[1] * high


def _corners(ranges: Iterable[tuple[float, float]]) -> np.ndarray:
    """All corners (n, len(ranges)) of a box, with zero where a range includes it."""
    ends = [(low, 0.0, high) if low < 0 < high else (low, high) for low, high in ranges]
    corners = list(itertools.product(*ends))
    return np.array(corners, dtype=float).reshape(len(corners), len(ends))


def _middle(environment: EnvironmentWiring, signals: Mapping[str, Signal]) -> float:
    """degC: of a radiant environment; its coefficient varies by 2 % for 10 K, which the margins cover."""
    switch = environment.switch
    share = (signals[switch].low + signals[switch].high) / 2 if switch else 0.0
    offset = environment.offset + share * environment.switched_offset
    if not environment.signal:
        return environment.temperature + offset
    return (signals[environment.signal].low + signals[environment.signal].high) / 2 + offset
