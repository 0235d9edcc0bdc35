"""Which trials a campaign makes, in an order in which an unfinished one is worth most."""

from __future__ import annotations

from collections.abc import Sequence

from twin.inject.draw.trial import FAMILIES, part_of
from twin.inject.experiment import Experiment

NULLS, EACH = 200, 10
SIZES = (1.0, 0.5, 2.0)
MORE = (("outside", 20), ("null_law", 10))
SEVERAL = (("pair", 10), ("two", 10), ("effect_and_sensor", 10))  # no figure of the goals
FAST = 4  # rounds that all nulls are in

Item = tuple[str, float, int]


def items(experiment: Experiment, catalogue: Sequence[str], first: int) -> list[Item]:
    """(family, factor of the nominal size, seed) of all trials from a seed on; catalogue: families in its order."""
    families = [name for name in catalogue if name in FAMILIES]
    result: list[Item] = []
    for k in range(EACH):
        nulls = range(min(k * NULLS // FAST, NULLS), min((k + 1) * NULLS // FAST, NULLS))
        sized = [(family, size, first + k) for family in families for size in SIZES]
        result += [item for item in sized if _differs(experiment, *item)]
        result += [(name, 1.0, first + i) for name, n in MORE for i in range(k * n // EACH, (k + 1) * n // EACH)]
        result += [("null", 1.0, first + i) for i in nulls]
    return result + [(name, 1.0, first + i) for name, n in SEVERAL for i in range(n)]


def _differs(experiment: Experiment, family: str, size: float, seed: int) -> bool:
    """Whether data of another size are others: a stuck sensor or a doubled signal is what it is."""
    nominal = part_of(experiment, family, 1.0, seed).hidden
    return size == 1.0 or part_of(experiment, family, size, seed).hidden != nominal
