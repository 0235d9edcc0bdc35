"""What a row of the table of laws says."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Argument:
    """A parameter or a signal of a law."""

    unit: str  # SI
    meaning: str
    default: float | None = None  # None: must be given
    low: float = 0.0  # physical bounds
    high: float = float("inf")


@dataclass(frozen=True)
class Validity:
    """Where a law holds: the published range of a correlation, the conditions of a formula."""

    holds: Callable  # same arguments as the law -> bool (array)
    text: str  # "0.1 < Ra < 1e12", as it is printed in a flag


@dataclass(frozen=True)
class Law:
    """A cited function f(**signals, **states, **parameters) -> W (loss) or W/(m^2 K) (film, joint)."""

    function: Callable
    kind: str  # "loss", "film" or "joint"
    source: str  # citation with equation number
    signals: Mapping[str, Argument] = field(default_factory=dict)
    parameters: Mapping[str, Argument] = field(default_factory=dict)
    # filled in by the model, from the step before: `temperature` [degC] of a loss, the mean of its surface; `surface`
    # and `ambient` [degC] of a film. A description may wire a signal instead.
    states: Mapping[str, Argument] = field(default_factory=dict)
    formula: str = ""  # as it is printed: "P = 3 R I^2"
    validity: Validity | None = None  # None: no published limits
    radiates: bool = True  # films: the surface sees its surroundings; False inside channels of a coolant
