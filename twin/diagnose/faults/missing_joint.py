"""Two parts exchange heat that the description does not join: an oil line, a cable, chips, a face that touches."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from twin.build.places import Place
from twin.diagnose.evidence.batch import Batch
from twin.diagnose.faults.context import Context
from twin.diagnose.faults.fault import Family, Fault, Slot
from twin.diagnose.model.study import Study
from twin.diagnose.result.diagnosis import Cause
from twin.diagnose.result.spot import Spot

LARGEST = 1000.0  # W/K: of a flow of 14 l/min of water, which brings all of its heat across
# W/K, prior standard deviation, a flow of 3 l/min of oil: without it one that makes two bodies one would have no size
USUAL = 100.0
# relative standard deviation of a size, chosen on 536 to 546 of `benchmarks.drawn_outside`: true sizes are 0.5 to 1.9
# times what is told there
OWN = 0.3


@dataclass(frozen=True)
class MissingJoint(Fault):
    """Between two places; its own place is ONE<>OTHER."""

    def fill(self, slot: Slot) -> None:
        probed, names = slot.study.probed, [p.name for p in slot.study.probed.places]
        spot = Spot.read(slot.unit.place)
        d = probed.B[names.index(spot.name)] - probed.B[names.index(spot.partner)]
        slot.slots.A[slot.s], slot.slots.gate[:, slot.s] = np.outer(d, d), slot.shape

    def prior(self, q: int) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros(q), np.full(q, USUAL**-2)

    def log_change(self, amplitude: float, sigma: float = 0.0) -> tuple[float, float]:
        """Its own logarithm: a strong one makes two bodies one, and nothing tells how strong."""
        return float(np.log(amplitude)), sigma / amplitude

    def amplitude(self, change: float, sigma: float = 0.0) -> tuple[float, float]:
        return float(np.exp(change)), float(np.exp(change)) * sigma


FAULTS = (
    MissingJoint(
        "missing_joint", "between", "W/K", "", 1, 0.5, own=OWN, bent=True, saturates=True, largest=LARGEST,
    ),
)  # fmt: skip


def pairs(study: Study, parts: Collection[frozenset[str]] | None = None) -> list[tuple[int, int]]:
    """Places, by number, of two parts that no contact joins: the largest of each, or all of these parts, by two."""
    probed = study.probed
    own = [i for i, place in enumerate(probed.places) if not Spot.read(place.name).pad]
    if parts is None:
        largest = sorted(own, key=lambda i: (bool(probed.places[i].film), probed.places[i].area), reverse=True)
        own = sorted({probed.places[i].members: i for i in reversed(largest)}.values())
    found = [(i, j, _between(probed.places[i], probed.places[j])) for i, j in combinations(own, 2)]
    return [
        (i, j) for i, j, between in found
        if all(len(pair) == 2 and pair not in probed.joined and (parts is None or pair in parts) for pair in between)
    ]  # fmt: skip


def _between(a: Place, b: Place) -> set[frozenset[str]]:
    return {frozenset((m, n)) for m in a.members for n in b.members}


def always_last(cause: Cause) -> bool:
    return True


def after_others(context: Context) -> list[Batch]:
    """None before anything else was searched (`twin.diagnose.search.paths`)."""
    return []


FAMILY = Family(
    21, "missing_joint", "Joint missing",
    "Two parts exchange heat that no contact of the description joins: an oil line, a cable, chips, faces that touch.",
    "-kappa d d^T x", "residuals of opposite sign on both, in proportion to their difference", "0.5 W/K", "positive",
    "every surface or node with every one of another part that no contact joins to it, once anything is out of order; "
    "always", "machine",
    after_others, what="missing joint", last=always_last,
)  # fmt: skip
