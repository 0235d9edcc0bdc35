"""Heat that the description lacks."""

from __future__ import annotations

from dataclasses import dataclass

from twin.diagnose.evidence.batch import Batch
from twin.diagnose.faults.context import Context, logs, most_heat, of_stretches, stretches
from twin.diagnose.faults.fault import Family, Fault, Slot


@dataclass(frozen=True)
class Heat(Fault):
    """Heat at a place."""

    def fill(self, slot: Slot) -> None:
        slot.force(slot.study.probed.B[slot.place], slot.shape)


# own: it leaves by the film of its own face, which differs from its group's by `nulls.Form.local_film`
HEAT = Heat("heat_source", "heat", "W", "", 1, 1.0, own=0.12)
FAULTS = (HEAT,)


def batches(context: Context) -> list[Batch]:
    """Everywhere: always, with every load signal, and in every window."""
    signals, blocks = list(context.elements.histories.signals), context.elements.heat_blocks
    histories = logs(context, signals, len(signals) + len(context.elements.histories.blocks))
    histories += of_stretches(stretches(context), before=len(signals))
    rows = [
        (p.name, [*(context.index["heat", p.name, s] for s in signals), *blocks[p.name]])
        for p in context.study.probed.places
    ]
    return HEAT.batches(rows, histories, most_heat(context))


FAMILY = Family(
    3, "heat_source", "Heat source missing",
    "Something makes heat that the description does not have: electronics, hydraulics, a bearing, a lamp.",
    "b_place s(t)", "follows its own on and off, or a logged signal; independent of the air", "1 W", "positive",
    "every surface; always, every load signal, every window of hours", "machine", batches,
    what="missing heat source",
)  # fmt: skip
