"""What is hidden in data, in numbers and words, and the trials that it is looked for in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from twin.logs.run import Run
from twin.machine.effects.effect import Window


@dataclass(frozen=True)
class Hidden:
    """One thing in a machine or its logs that the description does not know, in the words of the catalogue."""

    family: str
    place: str
    history: str  # in words
    size: float  # SI; of machines as `Effect.amplitude` of the family (`twin.machine.effects.edits`)
    unit: str
    windows: tuple[Window, ...] = ()  # none: always
    signal: str = ""
    exponent: float = 1.0
    settings: Mapping[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True)
class Trial:
    """Three runs of an experiment, in its order: two to fit, one sealed; and what is hidden in them."""

    name: str  # of a stored trial, or the family that it is drawn of
    seed: int
    hidden: tuple[Hidden, ...]  # nothing in a null
    runs: tuple[Run, ...]
    factor: float = 1.0  # of the nominal size
    parameters: Mapping[str, float] = field(default_factory=dict)  # path -> value there [SI], where they are known
