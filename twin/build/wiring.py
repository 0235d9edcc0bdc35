"""The LoadModel of a machine: names, laws, parameters in SI, certified ranges; the runtime finds it in the artefact."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping

import numpy as np

from twin.build.ports import ContactPorts
from twin.errors import DescriptionError
from twin.machine import wiring
from twin.machine.description import Machine
from twin.machine.kinematics import linear_axes
from twin.rom.law_values import law_values
from twin.rom.load_model import Film, Joint, LawUse, LoadModel, Signal

FILM_MARGIN = (0.5, 2.0)  # certified film coefficients: from half the least to twice the greatest value of the law
JOINT_MARGIN = 3.0  # certified joint conductances: a third to three times the described one


def load_model(machine: Machine, ports: ContactPorts) -> LoadModel:
    """Everything that turns a load log into heat, of a description whose references are sound.

    Raises DescriptionError for a film law that is not positive and finite within its signals' ranges.
    """
    signals = {name: wiring.signal(name, entry) for name, entry in machine.signals.items()}
    environments = tuple(wiring.environment(name, entry, machine) for name, entry in machine.environment.items())
    order = [name for name, _, _ in environments]
    films = []
    for name, entry in machine.films.items():
        use = wiring.film_law(name, entry, machine)
        low, high = film_range(use, signals, f"films.{name}")
        films.append(Film(name, use, order.index(entry.environment), low, high))
    return LoadModel(
        signals=tuple(signals.values()),
        axes=tuple(wiring.axis(name, machine) for name in linear_axes(machine)),
        environments=environments,
        sources=tuple(wiring.source(name, entry, machine) for name, entry in machine.sources.items()),
        films=tuple(films),
        joints=tuple(
            Joint(name, c.conductance, c.conductance / JOINT_MARGIN, c.conductance * JOINT_MARGIN)
            for name, c in machine.contacts.items()
            if c.kind == "fixed"
        ),
        ports=ports.names,
        rails=ports.rails,
        pairs=ports.pairs,
    )


def film_range(use: LawUse, signals: Mapping[str, Signal], where: str) -> tuple[float, float]:
    """Certified range [W/(m^2 K)] of a film: margins around its law over the corners of its signals' ranges.

    Zero counts as a corner where a range includes it: laws in |v| have their least value there. Raises DescriptionError
    where the law is not positive and finite: ranges are sampled on a logarithmic scale.
    """
    names = sorted(set(use.signals.values()))
    ranges = [(signals[n].low, signals[n].high) for n in names]
    combinations = list(
        itertools.product(*((low, 0.0, high) if low < 0 < high else (low, high) for low, high in ranges))
    )
    corners = np.array(combinations, dtype=float).reshape(len(combinations), len(names))
    values = law_values([use], dict(zip(names, corners.T, strict=True)), len(corners))
    low, high = float(values.min()), float(values.max())
    if not (low > 0 and math.isfinite(high)):
        raise DescriptionError(
            f"law '{use.law}' gives {low:g} .. {high:g} W/(m^2 K) over its signals' ranges",
            where,
            "film coefficients are finite and above zero, at rest too: check parameters and ranges; "
            "list surfaces without convection under `adiabatic` of their part",
        )
    return FILM_MARGIN[0] * low, FILM_MARGIN[1] * high
