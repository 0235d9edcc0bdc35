"""What a plan says: per suspicion what each next experiment would let these data see, per pair how far it separates."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Proposal:
    """One experiment for one suspicion."""

    experiment: str  # its name: "x to and fro", "sensor at bed.left"
    words: str  # what to do
    limit: float  # the smallest size that would then be named, in the suspicion's unit
    gain: float  # times smaller than today's (of factors: of their logarithms)


@dataclass(frozen=True)
class Separation:
    """One experiment for two causes that these data cannot separate."""

    experiment: str
    words: str
    expected: float  # LR (1 - cos^2)


@dataclass(frozen=True)
class Foresight:
    """The experiments for one suspicion, the best first."""

    family: str
    place: str
    unit: str
    today: float  # the limit in these data
    again: float  # and with the longest run made once more, which costs no thought
    largest: float | None  # size beyond which physics has no such cause, where one is known: a limit above it is none
    threshold: float  # that the statistic must reach
    switches: bool  # whether it acts in windows, which the new run is taken to have at the same hours
    proposals: tuple[Proposal, ...]


@dataclass(frozen=True)
class Apart:
    """The experiments for a pair, the best first."""

    first: str  # "heat_source bed.left"
    second: str
    today: float
    needed: float
    separations: tuple[Separation, ...]


@dataclass(frozen=True)
class Plan:
    suspicions: tuple[Foresight, ...]
    pairs: tuple[Apart, ...]
    assumptions: tuple[str, ...]
