"""A number of the machine that measurements may correct: its dotted path, what it acts on, bounds, prior.

A parameter acts on the reduced model affinely: it scales a power, a coefficient, a capacity or a TCP row, or shifts an
environment's temperature. So a fit needs no description and no new build, only the artefact.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any, Literal

from twin.rom.from_json import filled

Kind = Literal[
    "source", "film", "joint", "contact", "capacity", "expansion", "environment", "exponent", "wind", "wind_exponent"
]  # fmt: skip
Scale = Literal["log", "linear"]
# of laws of films, which no description has and a diagnosis alone varies
OF_LAWS: tuple[Kind, ...] = ("exponent", "wind", "wind_exponent")


@dataclass(frozen=True)
class Parameter:
    """`targets`: names in the load model (of sources, films, joints, contacts, environments), or members of bodies."""

    path: str  # "sources.y_motor.gain": its name in descriptions, fits and reports
    kind: Kind
    targets: tuple[str, ...]
    nominal: float  # SI
    unit: str  # SI
    low: float  # physical bounds, SI
    high: float
    sigma: float  # prior standard deviation: of ln(value / nominal) where `scale` is "log", else in `unit`
    scale: Scale = "log"
    component: int = -1  # expansions of lumped machines: 0, 1, 2 for x, y, z

    def coordinate(self, value: float) -> float:
        """The value [SI] in prior standard deviations from the nominal one: what a fit searches in."""
        distance = math.log(value / self.nominal) if self.scale == "log" else value - self.nominal
        return distance / self.sigma

    def value(self, coordinate: float) -> float:
        """The inverse of `coordinate`."""
        if self.scale == "log":
            return self.nominal * math.exp(self.sigma * coordinate)
        return self.nominal + self.sigma * coordinate

    def to_json(self) -> dict[str, Any]:
        return asdict(self)

    @classmethod
    def from_json(cls, d: Any) -> Parameter:
        """The inverse of `to_json`. Raises TypeError and ValueError as `twin.rom.from_json.filled`."""
        return filled(cls, d, "parameters")
