"""Where a cause is: read once from the name that reports and descriptions give it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum

_PARTNER = re.compile(r"<>|[><*]")


class Of(Enum):
    """What a place is of."""

    SURFACE = ""  # or a node
    SENSOR = "sensors"
    SIGNAL = "signals"
    FILM = "films"
    CONTACT = "contacts"
    ENVIRONMENT = "environment"
    SOURCE = "sources"
    AXIS = "axes"
    TCP = "tcp"
    RUN = "runs"
    MATERIAL = "materials"
    PART = "parts"
    SCALE = "scales"
    TANK = "tanks"

    @property
    def words(self) -> str:
        """As "film" of a film; none of what is told by its name alone."""
        if self in (Of.SURFACE, Of.AXIS, Of.TCP):
            return ""
        return "environment" if self is Of.ENVIRONMENT else self.value.removesuffix("s")


@dataclass(frozen=True)
class Spot:
    """A place, as "films.bed" or "bed.left" of a surface, or one with a partner: "sources.SOURCE>PLACE",
    "axes.AXIS<PART", "signals.SIGNAL*FACTOR", "sensors.ONE<>OTHER", "bed.left<>column.back".
    """

    text: str
    of: Of
    name: str  # "bed", of a surface all of it
    partner: str = ""

    @classmethod
    def read(cls, text: str) -> Spot:
        head, dot, rest = text.partition(".")
        of = Of(head) if dot and head in _HEADS else Of.SURFACE
        name, *partner = _PARTNER.split(rest if of is not Of.SURFACE else text, maxsplit=1)
        return cls(text, of, name, "".join(partner))

    @property
    def words(self) -> str:
        """As "film bed", or "motor and bed" of two that are joined; surfaces and the rest stay as they are."""
        if self.between:
            return f"{self.name} and {self.partner}"
        return f"{self.of.words} {self.text.partition('.')[2]}" if self.of.words else self.text

    @property
    def owner(self) -> str:
        """What it belongs to: the part of a surface, both of two, or what it is without its partner."""
        if self.between:
            return "<>".join(sorted((self.part, Spot.read(self.partner).part)))
        return self.part if self.of is Of.SURFACE else f"{self.of.value}.{self.name}"

    @property
    def part(self) -> str:
        """The part of a surface; of anything else what it is of."""
        return (self.name if self.of is Of.SURFACE else self.text).partition(".")[0]

    @property
    def within(self) -> str:
        """Without the last part of its name: the run of a start."""
        return self.text.rpartition(".")[0]

    @property
    def member(self) -> str:
        """The part or node that it may be: of a scale the one that it is as warm as."""
        return self.partner if self.of is Of.AXIS and self.partner else self.name.rpartition(".")[2]

    @property
    def declared(self) -> bool:
        """Whether it is an entry of the description with a number of its own."""
        return self.of in (Of.FILM, Of.CONTACT, Of.SOURCE, Of.MATERIAL)

    @property
    def air(self) -> bool:
        """Whether it is a film, or what films give their heat to."""
        return self.of in (Of.FILM, Of.ENVIRONMENT)

    @property
    def between(self) -> bool:
        """Whether it is two surfaces or nodes."""
        return self.of is Of.SURFACE and bool(self.partner)

    @property
    def pad(self) -> bool:
        """Whether it is the face of a contact."""
        return self.of is Of.CONTACT


_HEADS = frozenset(of.value for of in Of if of.value)
