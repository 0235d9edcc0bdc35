"""One thing that a description lacks or has wrong: what it is, where, how large, and when it acts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Window:
    """A stretch of a run in which something acts, and how strongly: several make a history."""

    run: str
    start: float  # s
    end: float  # s
    level: float = 1.0  # times the amplitude


@dataclass(frozen=True)
class Effect:
    """What `twin.machine.effects.edits` writes into a description; its table says what `amplitude` means by family."""

    family: str  # a key of EDITS: "heat_source"
    place: str  # "bed.x_motor", "films.bed", "contacts.x_guide", "sources.x_nut", "signals.x_current"
    amplitude: float  # in `unit`
    unit: str
    history: str = "always"  # in words: "x_current^2"
    signal: str = ""  # the signal that it follows, if one
    exponent: float = 1.0  # of that signal
    windows: tuple[Window, ...] = ()  # empty: always
    settings: Mapping[str, float | str] = field(default_factory=dict)  # what else its edit needs: medium temperature
