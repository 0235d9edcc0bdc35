"""A suspicion: a family at a location whose size a plan is made for, by the names that report.json prints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from twin.diagnose.evidence.batch import Batch, Hypothesis
from twin.diagnose.faults.catalogue import Family, family
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.limits import limits_at
from twin.diagnose.search.look import Search
from twin.errors import TwinError
from twin.nearest import did_you_mean

OPTION = "--plan"


@dataclass(frozen=True)
class Suspicion:
    """Sizes of one unit at one place of a family."""

    family: str
    place: str
    unit: str
    windowed: bool  # whether its limit is that of causes that switch, for want of others: as `limits_of` takes them

    def batches(self, detector: Detector) -> list[tuple[int, Batch, int]]:
        """Number among the detector's batches, batch, and place in it; of those with such histories."""
        return [
            (k, b, b.places.index(self.place))
            for k, b in enumerate(detector.columns.batches)
            if not b.fixed
            and (b.family, b.unit) == (self.family, self.unit)
            and self.place in b.places
            and self.histories(b)
        ]

    def histories(self, batch: Batch) -> list[int]:
        return [i for i, h in enumerate(batch.histories) if bool(h.windows) == self.windowed]


def known_suspicions(detector: Detector) -> dict[Suspicion, float]:
    """All that have a detection limit, with it (relative changes and logarithms of factors as they are)."""
    at = limits_at(detector)
    return {
        Suspicion(family, place, unit, windowed): size
        for (family, unit, place, windowed), size in at.items()
        if not windowed or (family, unit, place, False) not in at
    }


def known_family(text: str, families: Sequence[Family]) -> None:
    """Raises TwinError with the nearest name where a text begins with no family of the catalogue."""
    family(text.strip().partition(" ")[0], families, OPTION)


def named(text: str, detector: Detector) -> list[Suspicion]:
    """The suspicions of a text: "FAMILY PLACE", or "FAMILY" for the place at which its limit is worst.

    Raises TwinError with the nearest name for a family or a place that there is not.
    """
    every = known_suspicions(detector)
    name, _, place = (part.strip() for part in text.strip().partition(" "))
    families = list(dict.fromkeys(s.family for s in every))
    if name not in families:
        what = f"'{name}' has no detection limit in these runs"
        raise TwinError(what, OPTION, did_you_mean(name, families, "families"))
    own = {s: size for s, size in every.items() if s.family == name}
    if not place:
        return worst(own)
    places = list(dict.fromkeys(s.place for s in own))
    if place not in places:
        what = f"'{place}' is no place of {name} in these runs"
        raise TwinError(what, OPTION, did_you_mean(place, places, "places"))
    return [s for s in own if s.place == place]


def worst(limits: dict[Suspicion, float]) -> list[Suspicion]:
    """Per family and unit the one that is seen worst."""
    return [
        max((s for s in limits if (s.family, s.unit) == key), key=lambda s: limits[s])
        for key in dict.fromkeys((s.family, s.unit) for s in limits)
    ]


def worst_of_machine(detector: Detector, families: Sequence[Family]) -> list[Suspicion]:
    """`worst` of all that changes the machine: what a plan is made for where nothing is named or ambiguous."""
    groups = {f.name: f.group for f in families}
    return worst({s: v for s, v in known_suspicions(detector).items() if groups.get(s.family) == "machine"})


def pairs_of(found: Search) -> list[tuple[Hypothesis, Hypothesis]]:
    """The first cause of an ambiguous verdict with the two likeliest rivals that these data do not separate from it, of
    causes that every search has columns of."""
    if not found.accepted:
        return []
    first = found.accepted[0]
    chosen = first.hypothesis
    near = [
        other for other, cosine in first.rivals
        if max(int(h.batch.columns.max()) for h in (chosen, other)) < len(found.detector.index)
        and min(chosen.statistic, other.statistic) * (1.0 - cosine**2) <= found.detector.policy.apart
    ]  # fmt: skip
    return [(chosen, other) for other in near[:2]]


def suspicions_in(hypotheses: Sequence[Hypothesis], detector: Detector) -> list[Suspicion]:
    """The suspicions that hypotheses are; none of exact factors, which have no size."""
    wanted = [(h.family, h.name, h.batch.unit) for h in hypotheses]
    return [s for s in known_suspicions(detector) if (s.family, s.place, s.unit) in wanted]
