"""The law that a film really has: another form than described, alike where surfaces are some K warmer than the air."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from twin.inject.machines.draws import between, one_of, rounded, with_unit
from twin.machine.description import Film, Machine
from twin.machine.toml_text import value_text
from twin.physics.laws import LAWS
from twin.units import to_si

AIR, WARMER = 20.0, 5.0  # degC and K: where both laws give the same coefficient
RADIATION = 5.9  # W/(m^2 K) of a black surface at 23 degC: 4 sigma T^3
OF_AIR = 30.0  # W/(m^2 K): coefficients above are those of coolants, whose laws stay
USUAL = 0.25  # of a speed's certified range, where laws that follow it agree


@dataclass(frozen=True)
class _Law:
    """Another law; its convection is scaled by a gain to what is left of the coefficient beside radiation."""

    law: str
    parameters: dict[str, str | float]
    signals: dict[str, str]
    emissivity: float


def other_film(rng: np.random.Generator, machine: Machine, name: str) -> dict[str, str]:
    """Keys of the table of a film with new values [TOML]; none where its law stays: coolants, additional films.

    Raises KeyError for a film that the machine does not have.
    """
    film = machine.films[name]
    if film.additional or film.law not in _OTHERS:
        return {}
    convection = film.gain * _coefficient(machine, film.law, film.parameters, film.signals)
    radiant = 0.9 if film.emissivity is None else film.emissivity
    total = convection + RADIATION * (radiant if LAWS[film.law].radiates else 0.0)
    if total > OF_AIR:
        return {}
    new = one_of(rng, _OTHERS[film.law])(rng, total, film)
    own = _coefficient(machine, new.law, new.parameters, new.signals)
    return {
        "law": value_text(new.law),
        "gain": value_text(rounded((total - RADIATION * new.emissivity) / own, 4)),
        "emissivity": value_text(new.emissivity),
        "parameters": value_text(new.parameters),
        "signals": value_text(new.signals) if new.signals else "",
    }


def _coefficient(machine: Machine, law: str, parameters: dict[str, str | float], signals: dict[str, str]) -> float:
    """W/(m^2 K) of convection at the usual state."""
    found = LAWS[law]
    values = {k: a.default for k, a in found.parameters.items() if a.default is not None}
    values |= {k: to_si(v, found.parameters[k].unit) for k, v in parameters.items()}
    for k, name in signals.items():
        if k in found.signals:
            entry = machine.signals[name]
            top = entry.range[1]
            written = with_unit(top, entry.unit) if isinstance(top, float | int) else top
            values[k] = USUAL * to_si(written, found.signals[k].unit)
    states = {"surface": AIR + WARMER, "ambient": AIR}
    return float(found.function(**values, **{k: states[k] for k in found.states}))


def _radiating(total: float) -> float:
    """An emissivity that leaves convection at least a third of the coefficient."""
    return rounded(min(0.85, 0.6 * total / RADIATION), 2)


def _free(rng: np.random.Generator, total: float, film: Film) -> _Law:
    law = one_of(rng, ("free_vertical_plate", "free_vertical_plate_laminar"))
    return _Law(law, {"height": with_unit(between(rng, 0.1, 0.6), "m")}, {}, _radiating(total))


def _constant(rng: np.random.Generator, total: float, film: Film) -> _Law:
    return _Law("constant_film", {"natural": with_unit(rounded(total), "W/(m^2*K)")}, {}, 0.0)


def _power(rng: np.random.Generator, total: float, film: Film) -> _Law:
    """A forced film with another exponent of the speed than the 0.8 that is usual."""
    values: dict[str, str | float] = {
        "natural": with_unit(rounded(0.6 * total), "W/(m^2*K)"),
        "forced": with_unit(rounded(total * rng.uniform(0.8, 1.6)), "W/(m^2*K)"),
        "exponent": rounded(rng.uniform(0.55, 0.7)),
    }
    return _Law("forced_film", values, dict(film.signals), 0.0)


def _mixed(rng: np.random.Generator, total: float, film: Film) -> _Law:
    size: dict[str, str | float] = {
        "length": with_unit(between(rng, 0.15, 0.4), "m"), "height": with_unit(between(rng, 0.05, 0.15), "m"),
    }  # fmt: skip
    return _Law("mixed_plate", size, dict(film.signals), _radiating(total))


_OTHERS: dict[str, tuple[Callable[[np.random.Generator, float, Film], _Law], ...]] = {
    "constant_film": (_free,),
    "forced_film": (_power, _mixed),
    "mixed_plate": (_power,),
    "free_vertical_plate": (_constant,),
    "free_box": (_constant, _free),
}
