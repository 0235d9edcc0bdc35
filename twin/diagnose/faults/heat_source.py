"""Heat that the description lacks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.diagnose.evidence.batch import Batch, History
from twin.diagnose.faults.context import Context, logged, most_heat, stretches, wide
from twin.diagnose.faults.elements import Elements
from twin.diagnose.faults.fault import Family, Fault, Unit, forced, place_number
from twin.diagnose.model.slots import Slots
from twin.diagnose.model.study import Study


@dataclass(frozen=True)
class Heat(Fault):
    """Heat at a place."""

    def fill(self, slots: Slots, s: int, unit: Unit, k: int, study: Study, elements: Elements) -> None:
        forced(slots, s, study.probed.B[place_number(study, unit.place)], unit.shapes[k])


HEAT = Heat("heat_source", "heat", "W", "", 1, 1.0)
FAULTS = (HEAT,)


def batches(context: Context) -> list[Batch]:
    """Everywhere: always, with every load signal, and in every window."""
    signals, blocks = context.elements.histories.signals, context.elements.heat_blocks
    n = len(signals) + len(context.elements.histories.blocks)
    histories = [logged(context, name, np.eye(n)[[i]]) for i, name in enumerate(signals)]
    histories += [
        History(name, wide(w, len(signals), n)[None], windows=windows) for name, w, windows in stretches(context)
    ]
    rows = [
        (p.name, [*(context.index["heat", p.name, s] for s in signals), *blocks[p.name]])
        for p in context.study.probed.places
    ]
    return [HEAT.batch(rows, histories, most_heat(context))]


FAMILY = Family(
    3, "heat_source", "Heat source missing",
    "Something makes heat that the description does not have: electronics, hydraulics, a bearing, a lamp.",
    "b_place s(t)", "follows its own on and off, or a logged signal; independent of the air", "1 W", "positive",
    "every surface; always, every load signal, every window of hours", "machine", batches,
    what="heat that the description lacks",
)  # fmt: skip
